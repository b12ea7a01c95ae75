"""compare_states.py DIR DIR: the largest difference of a joint angle between the final states of two runs."""
import json
import math
import sys
from pathlib import Path

a, b = (json.loads((Path(folder) / "summary.json").read_text())["final_state"]["q"] for folder in sys.argv[1:3])
largest = max(abs(math.remainder(a[name] - b[name], 2 * math.pi)) for name in a if isinstance(a[name], float))
print(f"largest difference of a joint angle: {largest:.1e} rad")
