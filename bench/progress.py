# SPDX-License-Identifier: Apache-2.0
"""What the user sees while something is measured."""


def say(text: str) -> None:
    """Print a line of progress at once."""
    print(f"      {text}", flush=True)
