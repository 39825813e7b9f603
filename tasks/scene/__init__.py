"""The scene: camera, parts, physics, renderer, frames."""
