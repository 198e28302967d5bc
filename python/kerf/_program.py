"""The program `kerf`, which lies in the package: it takes this process over."""

import os
import signal
import sys
from pathlib import Path

PROGRAM = Path(__file__).parent / "bin" / "kerf"


def main():
    if not PROGRAM.is_file():
        sys.exit("kerf: this package was built without the program")
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # Python ignores it: `kerf info --schema | head` ends as other programs do
    os.execv(PROGRAM, ["kerf", *sys.argv[1:]])
