"""Recordings of real machines, diagnosed and compared with what their authors published."""
