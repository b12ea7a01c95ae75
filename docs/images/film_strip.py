#!/usr/bin/env python3
"""The pictures of motion: film_strip.py PORTHOS (the command, e.g. build/native/apps/porthos)

docs/images/film_strip.png, of README.md: five stills of the mission's playback by `porthos film`, cut to the craft, side by
side with their times. docs/site/static/mission.webp and mission.png, of the site: the capture as a loop of six seconds, and a
still of it for readers who do not want motion. Needs Chromium and python3-pil; takes some minutes.
"""
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

HERE = Path(__file__).resolve().parent
STILLS = [(0, "a target tumbles"), (10, ""), (20, "the hand has it"), (200, "wheels take the tumble"), (1800, "the tumble is gone")]
WIDTH, GROUND, INK = 330, (20, 26, 33), (205, 213, 222)
FRAMES, PER_SECOND, LAST = 72, 12, 48  # of the loop; the last one at 48 s


def still(porthos, folder, time, size, cut):
    """cut: left, top, right, bottom."""
    picture = folder / "still.png"
    command = [porthos, "film", folder, "--from", str(time), "--size", size, "--dark", "--no-text", "--out", picture]
    subprocess.run(list(map(str, command)), check=True, stdout=subprocess.DEVNULL)
    return Image.open(picture).convert("RGB").crop(cut)


def strip(porthos, folder):
    cuts = [still(porthos, folder, time, "960x800", (140, 60, 820, 680)) for time, _ in STILLS]
    stills = [c.resize((WIDTH, WIDTH * c.height // c.width), Image.LANCZOS) for c in cuts]
    height = stills[0].height
    whole = Image.new("RGB", (WIDTH * len(stills), height + 30), GROUND)
    draw = ImageDraw.Draw(whole)
    font = ImageFont.truetype("/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", 17)
    for k, (picture, (time, what)) in enumerate(zip(stills, STILLS)):
        whole.paste(picture, (WIDTH * k, 0))
        draw.text((WIDTH * k + 14, height), f"{time} s" + (f"  {what}" if what else ""), font=font, fill=INK)
    whole.save(HERE / "film_strip.png", optimize=True)


def loop(porthos, folder):
    frames = [still(porthos, folder, LAST * k / FRAMES, "1280x760", (120, 60, 1160, 600)).resize((832, 432), Image.LANCZOS) for k in range(FRAMES)]
    static = HERE.parent / "site/static"
    frames[0].save(static / "mission.webp", save_all=True, append_images=frames[1:], duration=1000 // PER_SECOND, loop=0, quality=60, method=6)
    frames[-1].save(static / "mission.png", optimize=True)


def main():
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene = HERE.parents[1] / "examples/mission/scene.toml"
        subprocess.run([sys.argv[1], "run", scene, "--duration", "1800", "--out", folder], check=True, stdout=subprocess.DEVNULL)
        strip(sys.argv[1], folder)
        loop(sys.argv[1], folder)


if __name__ == "__main__":
    main()
