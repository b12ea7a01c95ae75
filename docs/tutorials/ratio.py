"""ratio.py DIR DIR: how much smaller the energy error of the second run is."""
import json
import sys
from pathlib import Path

a, b = (json.loads((Path(folder) / "summary.json").read_text())["energy"]["max_rel_error"] for folder in sys.argv[1:3])
print(f"energy errors {a:.1e} and {b:.1e}: ratio {a / b:.0f}")
