"""Robots with many joints and hidden physics: trees of hinges and slides, written as MJCF or URDF."""
