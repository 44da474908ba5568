# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees to the core's shading graph: one converter class a node type, in `table.py`."""
