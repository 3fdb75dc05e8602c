# SPDX-License-Identifier: Apache-2.0
"""On how many threads commands evaluate networks."""

import os

import torch

_WISH = "OMP_NUM_THREADS"


def compute_on_one_thread() -> None:
    """Evaluate networks on one thread, unless the environment says how many.

    They are small: on an idle computer a second thread saves a tenth of the time. Where something
    else keeps its core busy, like the same command for another map, waiting for it takes thirty
    times as long as all the rest.
    """
    if _WISH not in os.environ:
        torch.set_num_threads(1)
