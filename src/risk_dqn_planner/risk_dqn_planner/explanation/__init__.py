# SPDX-License-Identifier: Apache-2.0
"""Why a decision was taken: in numbers, and in one sentence made from them."""
