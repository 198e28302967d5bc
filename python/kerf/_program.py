"""The program `kerf`, which lies in the package: it takes this process over."""

import os
import sys
from pathlib import Path

PROGRAM = Path(__file__).parent / "bin" / "kerf"


def main():
    if not PROGRAM.is_file():
        sys.exit("kerf: this package was built without the program")
    os.execv(PROGRAM, ["kerf", *sys.argv[1:]])
