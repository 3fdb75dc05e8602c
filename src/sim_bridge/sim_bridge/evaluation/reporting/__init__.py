# SPDX-License-Identifier: Apache-2.0
"""The results page and its figures, from results.json; nothing here decides any number of it."""
