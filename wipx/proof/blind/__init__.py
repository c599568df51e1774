"""The blind benchmark: processes that draw, diagnose and judge robots whose physics is sealed."""
