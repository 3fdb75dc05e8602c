# SPDX-License-Identifier: Apache-2.0
"""Risk of a situation: the two safety conditions of the paper and their worst case."""
