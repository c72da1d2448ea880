"""Recordings of other software made into captures: ROS bags, RealSense recordings, TUM folders."""
