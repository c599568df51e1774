"""The completed robot for other simulators: MJCF, URDF, actuator settings, and a runtime around MuJoCo's step."""
