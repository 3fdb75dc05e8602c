# SPDX-License-Identifier: Apache-2.0
"""Sets up what the project needs to run: a Python environment with ROS 2 and the built packages.

`ros` finds ROS, `interpreters` finds Python, `prerequisites` looks for a compiler and room,
`python_environment` makes `.venv`, `build` runs colcon, `activation` writes the shell script that
puts a command into the result, and `main` runs them in this order. Each step leaves a stamp of
what it was made from, so that it is repeated only when that changed or when it was cut short.
"""
