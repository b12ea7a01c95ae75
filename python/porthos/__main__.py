"""python3 -m porthos plot DIR [FILE]    pictures of the run in DIR, as PNG or SVG"""

import sys

from ._core import InvalidArgument, IoError
from .plotting import plot


def main(arguments: list[str]) -> int:
    if len(arguments) not in (2, 3) or arguments[0] != "plot":
        print(__doc__, file=sys.stderr)
        return 2
    try:
        plot(*arguments[1:])
    except InvalidArgument as e:
        print(f"porthos: {e}", file=sys.stderr)
        return 2
    except IoError as e:
        print(f"porthos: {e}", file=sys.stderr)
        return 5
    return 0


sys.exit(main(sys.argv[1:]))
