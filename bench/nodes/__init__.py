# SPDX-License-Identifier: Apache-2.0
"""The nodes as processes over DDS: how late their answers are, and how regular.

`driving` plays traffic to both nodes in real time, `answering` situations to the policy node in
simulated time; `sections` makes a Section of both, `page` docs/timing.md. Times are of the wall
clock, because others wait for the answers: what else runs on the computer counts.
"""
