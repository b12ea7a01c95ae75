#!/usr/bin/env python3
"""units.py BUILD [--commands] ROOM...: the compiled files of the rooms, unity files too, or the commands that check them, one a line."""
import json
import sys
from pathlib import Path

build, rooms = Path(sys.argv[1]), [a for a in sys.argv[2:] if a != "--commands"]
for entry in json.loads((build / "compile_commands.json").read_text()):
    output = Path(entry["command"].split(" -o ")[1].split()[0]).parts   # phs/CMakeFiles/porthos_phs.dir/check.cpp.o
    if output[0] in rooms:
        if "--commands" in sys.argv:
            print(f"cd {entry['directory']} && {entry['command'].split(' -o ')[0]} -fsyntax-only -Werror {entry['file']}")
        else:
            print(entry["file"])
