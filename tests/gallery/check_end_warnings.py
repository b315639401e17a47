"""What a run warns of at its end: what it was asked for and did not do, and nothing where it did.

usage: check_end_warnings.py PROGRAM
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

#: A tube without a floor, which a source shall fill, over a sink
TUBE = """\
&wall name = 'l' outline = 'rectangle' low = -0.06, 0 high = -0.05, 0.3 /
&wall name = 'r' outline = 'rectangle' low = 0.05, 0 high = 0.06, 0.3 /
&source name = 'feed' low = -0.05, 0.2 high = 0.05, 0.28 velocity = 0, -1 count = {count} /
&sink name = 'bin' low = -0.3, -0.3 high = 0.3, -0.02 interval = 50 /
&forces stiffness = 1e6 /
&integrate duration = 0.4 /
"""
#: Two walls with loads along x, and a grain above or between them
PISTONS = """\
&wall name = 'l' outline = 'rectangle' low = -0.06, 0 high = -0.05, 0.1 /
&wall name = 'r' outline = 'rectangle' low = 0.05, 0 high = 0.06, 0.1 /
&wall name = 'far' outline = 'rectangle' low = 0.08, {height} high = 0.09, 0.6 /
&grains name = 'g' region = 'at' at = {place} shape = 'rectangle' width = 0.04 height = 0.04 /
&load name = 'a' wall = 'l' direction = 'x' force = 20 mass = 1 damping_ratio = 0.005 /
&load name = 'b' wall = 'r' direction = 'x' force = -20 mass = 1 damping_ratio = 0.005 /
&load name = 'c' wall = 'far' direction = 'x' force = -10 mass = 1 damping_ratio = 0.005 /
&forces gravity = 0, 0 stiffness = 1e6 /
&integrate duration = 0.2 dt = 2e-5 /
"""
#: Namelist, part of the warning, and whether the run has it
CASES = (
    (TUBE.format(count=300), "free bodies are there at the end, of 300 up to which &source feed fills the run; ", True),
    (TUBE.format(count=20), "fills the run", False),
    (PISTONS.format(place="0, 0.4", height=0.5), "the walls of &load a and &load b have passed into or", True),
    (PISTONS.format(place="0, 0.4", height=0.5), "&load c have passed", False),
    (PISTONS.format(place="0, 0.05", height=0.5), "through each other", False),
    (PISTONS.format(place="0, 0.05", height=0), "the walls of &load b and &load c have passed into or", True),
)


def main():
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as work:
        for number, (text, part, is_told) in enumerate(CASES):
            path = Path(work) / f"case_{number}.nml"
            path.write_text(f"{text}&output folder = '{work}/result_{number}' /\n", encoding="utf-8")
            done = subprocess.run([program, "run", str(path)], capture_output=True, text=True, timeout=600, check=True)
            told = re.findall(r"^warning: (.*)$", done.stdout, re.MULTILINE)
            assert sum(part in line for line in told) == is_told, (number, part, told)
            assert (f"\nwarnings: {len(told)} at the end\n" in done.stdout) == (len(told) > 0), (number, done.stdout)


if __name__ == "__main__":
    main()
