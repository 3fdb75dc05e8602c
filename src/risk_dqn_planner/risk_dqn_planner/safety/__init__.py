# SPDX-License-Identifier: Apache-2.0
"""Joint worst-case check: which actions leave the ego a manoeuvre that is safe against everyone."""
