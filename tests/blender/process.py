"""How scripts that a Python with bpy runs begin and end."""

from __future__ import annotations

import os
import sys
import traceback
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from collections.abc import Callable


def run(main: Callable[..., None]) -> NoReturn:
    """Call `main` with the command line and end the process; the exit code is 1 after an error."""
    code = 0
    try:
        main(*sys.argv[1:])
    except Exception:
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    # Some versions crash or hang when Python ends in the ordinary way.
    os._exit(code)
