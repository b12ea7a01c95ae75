#!/usr/bin/env python3
"""docs/images/film_strip.png, the picture of README.md: film_strip.py PORTHOS (the command, e.g. build/native/apps/porthos)

Five stills of the mission's playback by `porthos film`, cut to the craft, side by side with their times. Needs Chromium and
python3-pil.
"""
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

HERE = Path(__file__).resolve().parent
STILLS = [(0, "a target tumbles"), (10, ""), (20, "the hand has it"), (200, "wheels take the tumble"), (1800, "the tumble is gone")]
SIZE, CUT = "960x800", (140, 60, 820, 680)  # left, top, right, bottom
WIDTH, GROUND, INK = 330, (20, 26, 33), (205, 213, 222)


def still(porthos, folder, time):
    picture = folder / f"{time}.png"
    command = [porthos, "film", folder, "--from", str(time), "--size", SIZE, "--dark", "--no-text", "--out", picture]
    subprocess.run(list(map(str, command)), check=True, stdout=subprocess.DEVNULL)
    cut = Image.open(picture).convert("RGB").crop(CUT)
    return cut.resize((WIDTH, WIDTH * cut.height // cut.width), Image.LANCZOS)


def main():
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene = HERE.parents[1] / "examples/mission/scene.toml"
        subprocess.run([sys.argv[1], "run", scene, "--duration", "1800", "--out", folder], check=True, stdout=subprocess.DEVNULL)
        stills = [still(sys.argv[1], folder, time) for time, _ in STILLS]
    height = stills[0].height
    strip = Image.new("RGB", (WIDTH * len(stills), height + 30), GROUND)
    draw = ImageDraw.Draw(strip)
    font = ImageFont.truetype("/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", 17)
    for k, (picture, (time, what)) in enumerate(zip(stills, STILLS)):
        strip.paste(picture, (WIDTH * k, 0))
        draw.text((WIDTH * k + 14, height), f"{time} s" + (f"  {what}" if what else ""), font=font, fill=INK)
    strip.save(HERE / "film_strip.png", optimize=True)


if __name__ == "__main__":
    main()
