"""A pool process ends with its parent, even in the middle of LAPACK.

A parent that was killed cannot tell its children to end; one in a long solve would go on for
minutes, for nothing. The kernel can tell them, on Linux; elsewhere they end after their task.
"""

import ctypes
import signal
import sys
from typing import Any

from celery.signals import worker_process_init

PR_SET_PDEATHSIG = 1


@worker_process_init.connect
def _end_with_parent(**_: Any) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
