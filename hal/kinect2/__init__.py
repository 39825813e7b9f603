"""Kinect v2 as a camera; the vendor's package is imported in a separate process."""

from hal.kinect2.camera import Kinect2Camera
from hal.kinect2.config import Kinect2Config

__all__ = ["Kinect2Camera", "Kinect2Config"]
