#!/usr/bin/env python3
"""units.py BUILD ROOM...: the files of compile_commands.json that belong to the rooms, unity files too, one a line."""
import json
import sys
from pathlib import Path

build, rooms = Path(sys.argv[1]), sys.argv[2:]
for entry in json.loads((build / "compile_commands.json").read_text()):
    output = Path(entry["output"]).parts
    if output[0] in rooms and "CMakeFiles" in output[1:3]:
        print(entry["file"])
