#!/usr/bin/env python3
"""Runs the benchmarks and writes docs/benchmarks.md.

  python3 bench/page.py                   run everything that is built, keep the JSON in results/bench, write the page
  python3 bench/page.py --from results/bench      write the page again from what was measured before
  python3 bench/page.py --only kernels,peers      measure these again, take the rest from before

A busy machine slows single measurements: of every repetition the fastest counts, and ratios to other libraries are of
programs that took turns in one run.
"""
import argparse
import datetime
import json
import os
import pathlib
import platform
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
DATA = ROOT / "tests/data"
PEER_MODELS = [("--fixed", "reference/pinocchio/urdf/panda7.urdf", "7-joint arm"),
               ("--free", "reference/pinocchio/urdf/sat_panda.urdf", "arm on a free base"),
               ("--free", "models/talos.urdf", "humanoid"),
               ("--free", "reference/pinocchio/urdf/hyq.urdf", "quadruped")]
TITLES = {pathlib.Path(file).stem: title for _, file, title in PEER_MODELS}
TARGETS = {"aba": 0.45, "rnea": 0.5, "crba": 0.65, "field": 0.35}
SLOPES = {"RNEA derivatives": 0.6, "ABA derivatives": None, "Hessian": 0.4}  # aims; the Hessian's beside ABA derivatives


def run(*command):
    print("+", *command, file=sys.stderr)
    return subprocess.run([str(c) for c in command], check=True, stdout=subprocess.PIPE, text=True, cwd=ROOT).stdout


# --- measuring --------------------------------------------------------------------------------------------------------
def measure_kernels(build, out):
    program = build / "bench/kernels/porthos_kernels"
    if not program.exists():
        return print(f"not built: {program}", file=sys.stderr)
    run(program, "--benchmark_repetitions=25", "--benchmark_out_format=json",
        f"--benchmark_out={out / 'kernels.json'}", "--benchmark_enable_random_interleaving=true")


def measure_step(build, out):
    program = build / "bench/porthos_bench"
    if not program.exists():
        return print(f"not built: {program}", file=sys.stderr)
    run(program, "--benchmark_filter=^(gauss16_step|eight_stages)/", "--benchmark_repetitions=9", "--benchmark_min_time=0.1",
        "--benchmark_enable_random_interleaving=true", "--benchmark_out_format=json", f"--benchmark_out={out / 'step.json'}")


def measure_peers(build, out):
    program = build / "bench/peers/porthos_peers"
    models = [a for base, file, _ in PEER_MODELS for a in (base, DATA / file)]
    if not program.exists() or not models:
        return print("no peers: the program or the models are not there", file=sys.stderr)
    run(program, "--rounds", "500", "--json", out / "peers.json", *models)
    run(program, "--rounds", "200", "--json", out / "peers_gravity.json", "--gravity", *models)


def measure_compile(build, out):
    before, now = load(out / "compile.json") or {}, json.loads(run(ROOT / "bench/compile_time.sh"))
    for key in ("full_build_s", "full_build_wall_s"):  # timed by hand: --full
        now[key] = now[key] or before.get(key)
    (out / "compile.json").write_text(json.dumps(now))


def measure_compare(build, out):
    program = next((p for p in (build / "apps/porthos", ROOT / "build/native/apps/porthos") if p.exists()), None)
    if not program:
        return print("no work-precision figures: the porthos command is not built", file=sys.stderr)
    run(program, "compare", "examples/ets_vii/scene.toml", "--budget", "40", "--out", out / "compare")


# --- the page ---------------------------------------------------------------------------------------------------------
def load(path):
    return json.loads(path.read_text()) if path.exists() and path.stat().st_size else None


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(str(c) for c in r) + " |" for r in rows]) + "\n"


def time_text(ns):
    return f"{ns:.0f} ns" if ns < 1e4 else f"{ns / 1e3:.1f} µs" if ns < 1e7 else f"{ns / 1e6:.1f} ms"


def size_text(n):
    return f"{n / 1024:.1f} KiB" if n < 1 << 20 else f"{n / (1 << 20):.1f} MiB"


class Kernels:
    """The fastest repetition of each benchmark."""

    def __init__(self, data):
        self.context, self.best = data["context"], {}
        for b in data["benchmarks"]:
            if b.get("run_type") == "iteration":
                name = re.sub("/iterations:[0-9]+", "", b["run_name"])
                old = self.best.get(name)
                key = "real_time" if "real_time" in name else "cpu_time"
                if old is None or b[key] < old[key]:
                    self.best[name] = b

    def __getitem__(self, name):
        return self.best.get(name)

    def ns(self, name):
        """Per state."""
        b = self.best[name]
        return b["cpu_time"] / b["lanes"]


def ratios(rows, wide):
    """wide: registers hold eight numbers."""
    get = {(r["model"], r["subject"], r["what"]): r for r in rows}
    models = list(dict.fromkeys(r["model"] for r in rows))
    body = []
    for what, bar in TARGETS.items():
        body.append([f"{what if what == 'field' else what.upper()} / best", f"≤ {bar}"] +
                    [f"{get[m, 'Porthos', what]['ratio']:.2f}" for m in models])
    for what in ("field, 4 lanes", "field, 8 lanes", "aba, 4 lanes", "aba, 8 lanes"):
        aim = "field's × 0.8" if what.startswith("aba") else "≥ 20, humanoid 14" if wide and "8" in what else "≥ 11" if not wide else ""
        body.append([f"best ABA / {what.replace('aba', 'ABA')}, per state", aim] +
                    [f"{1 / get[m, 'Porthos', what]['ratio']:.1f}" for m in models])
    for what, bar in SLOPES.items():
        if all("ratio" in get.get((m, "Porthos", what), {}) for m in models):
            body.append(["Hessian of H / best ABA derivatives" if what == "Hessian" else f"{what} / best", f"≤ {bar}" if bar else ""] +
                        [f"{get[m, 'Porthos', what]['ratio']:.2f}" for m in models])
    return table(["ratio", "aim"] + [TITLES.get(m, m) for m in models], body)


def peers_section(rows, heavy, wide):
    text = "## Beside other libraries\n"
    if not rows:
        return text + ("No other library was found when this page was made. `porthos_peers` looks for RBDL, Pinocchio "
                       "(`CMAKE_PREFIX_PATH`), MuJoCo, DART, Simbody and Bullet (Debian's `libmujoco-dev`, "
                       "`libdart-dev`, `libsimbody-dev`, `libbullet-dev`).\n")
    names = list(dict.fromkeys(r["subject"] for r in rows if r["subject"] != "Porthos"))
    text += (f"Present: {', '.join(names)}. The bar is the fastest of them, of each algorithm on each model; for the "
             "field it is the fastest ABA. All programs take turns on the same 64 states in one run; what is given is the "
             "fastest of several hundred batches. Before anything is timed the accelerations, torques, mass matrices and derivatives are "
             "compared with Porthos' (1e-10; MuJoCo, which diagonalises inertias, 1e-5).\n\n")
    get = {(r["model"], r["subject"], r["what"]): r for r in rows}
    models = list(dict.fromkeys(r["model"] for r in rows))
    head = ["one state"] + [TITLES.get(m, m) for m in models]
    body = []
    for what in ("aba", "rnea", "crba", *SLOPES):
        for subject in ["Porthos"] + names:
            times = [get.get((m, subject, what)) for m in models]
            title = "Hessian of H" if what == "Hessian" else what if what in SLOPES else what.upper()
            if any(times):  # not every library has every algorithm
                body.append([f"{title}, {subject}"] + [time_text(t["ns"]) if t else "" for t in times])
    body.append(["field, Porthos"] + [time_text(get[m, "Porthos", "field"]["ns"]) for m in models])
    text += table(head, body) + "\n"
    text += ratios(rows, wide)
    if heavy:
        get = {(r["model"], r["what"]): r["ratio"] for r in heavy if r["subject"] == "Porthos"}
        text += ("\nAs in orbit there is no gravity in these figures. With gravity, which the field has to add and the others carry as an "
                 "acceleration of the base, in a run of its own:\n\n")
        text += table(["ratio, with gravity", "aim"] + head[1:],
                      [[f"{what if what == 'field' else what.upper()} / best", f"≤ {0.4 if what == 'field' else bar}"] +
                       [f"{get[m, what]:.2f}" for m in models] for what, bar in TARGETS.items()])
    return text


def kernels_section(k):
    one, wide = k["peak/one_number"]["flop_rate"], k["peak/one_register"]["flop_rate"]
    text = ("## Operations and the machine's limit\n"
            "Additions, multiplications and divisions per state, counted by a scalar that counts (`bench/kernels/counted.h`; a "
            "sine with its cosine is 62 of them), and the rate they amount to. The peak is a loop of independent "
            f"multiplications and additions in the same session: {one / 1e9:.1f} GFlop/s with one number at a time, "
            f"{wide / 1e9:.1f} with a register of them. A fused multiply-add counts as one operation.\n\n")
    models = ["ets_vii", "panda7", "sat_panda", "hyq", "talos"]
    body = []
    for m in models:
        for kernel in ("field", "field_4_lanes", "field_8_lanes", "aba", "aba_4_lanes", "rnea", "crba"):
            b = k[f"{kernel}/{m}"]
            if not b:
                continue
            peak = one if b["lanes"] == 1 else wide
            body.append([m, kernel.replace("_", " ").replace("field ", "field, ").replace("aba ", "aba, "),
                         f"{b['flops']:.0f}", f"{100 * b['fmas'] / b['flops']:.0f} %", time_text(k.ns(f"{kernel}/{m}")),
                         f"{b['flop_rate'] / 1e9:.1f}", f"{100 * b['flop_rate'] / peak:.0f} %",
                         size_text(b["workspace_bytes"])])
    text += table(["model", "kernel", "operations", "fused", "time per state", "GFlop/s", "of the peak", "workspace"], body)
    g, f = k["field_with_gravity/ets_vii"], k["field/ets_vii"]
    if g:
        text += (f"\nWith uniform gravity: {time_text(g['cpu_time'])} against "
                 f"{time_text(f['cpu_time'])} for the field of ETS-VII.\n")
    return text


def step_section(data, heading="## A step"):
    if not data:
        return ""
    k = Kernels(data)
    body = []
    for name in (n.split("/")[1] for n in k.best if n.startswith("eight_stages/")):
        step, alone = k[f"gauss16_step/{name}"], k[f"eight_stages/{name}"]["cpu_time"]
        inside = 1e9 * step["evaluation"]
        body.append([name, f"{step['sweeps']:.1f}", time_text(step["cpu_time"]), time_text(alone), time_text(inside),
                     f"{inside / alone:.2f}"])
    return (f"\n{heading}\nA step of `gauss16` evaluates its eight stages together, once an iteration. What stands around the field is the sums over "
            "stages, the stop rule and the update of the state.\n\n"
            + table(["model", "iterations a step", "step", "evaluation alone", "in the step", "ratio (aim: 1.15)"], body))


def other_section(folder):
    """The same ratios for a build with other registers, on the same machine."""
    data, rows = load(folder / "kernels.json"), load(folder / "peers.json")
    if not data:
        return ""
    k = Kernels(data)
    text = (f"\n## The same with {k.context['porthos_simd']}\n`{k.context['porthos_flags']}`, on the same machine"
            f"{'; peers compiled likewise' if rows else ''}.\n\n")
    if rows:
        text += ratios(rows, "512" in k.context["porthos_simd"]) + "\n"
    body = []
    for m in ("ets_vii", "panda7", "sat_panda", "hyq", "talos"):
        if k[f"field/{m}"]:
            body.append([m] + [time_text(k.ns(f"{what}/{m}")) if k[f"{what}/{m}"] else ""
                               for what in ("field", "field_4_lanes", "field_8_lanes", "aba", "rnea", "crba")])
    return text + table(["time per state", "field", "field, 4 lanes", "field, 8 lanes", "ABA", "RNEA", "CRBA"], body) + step_section(
        load(folder / "step.json"), "### A step")


def scaling_section(k, busy):
    text = "\n## Scaling\nChains of revolute joints; time and bytes per body.\n\n"
    body = []
    for n in (10, 100, 1000, 10000):
        row = [n]
        for kernel in ("field", "aba", "rnea", "field_4_lanes"):
            row.append(f"{k.ns(f'{kernel}/chain{n}') / n:.1f} ns")
        b = k[f"field/chain{n}"]
        body.append(row + [f"{b['model_bytes'] / n:.0f} B", f"{b['workspace_bytes'] / n:.0f} B",
                           f"{k[f'field_4_lanes/chain{n}']['workspace_bytes'] / n:.0f} B"])
    text += table(["bodies", "field", "ABA", "RNEA", "field, 4 lanes, per state", "model", "workspace", "workspace, 4 lanes"], body)
    ratios = ", ".join(f"{name} {k.ns(f'{kernel}/chain1000') / k.ns(f'{kernel}/chain10') / 100:.2f}"
                       for kernel, name in (("field", "field"), ("aba", "ABA"), ("rnea", "RNEA"), ("field_4_lanes", "4 lanes")))
    text += f"\n1000 links against 10, cost per body: {ratios} (aim: 1.3).\n"
    t1 = k["threads/field_4_lanes/real_time/threads:1"]
    t2 = k["threads/field_4_lanes/real_time/threads:2"]
    if t1 and t2 and busy:
        text += "\nTwo threads against one: not given, the machine was busy with other work.\n"
    elif t1 and t2:
        gain = t1["real_time"] / t2["real_time"]  # per iteration of either thread
        text += (f"\nTwo threads, each with a workspace of its own, make {gain:.2f} times the states of one by the clock "
                 f"(ETS-VII, field, 4 lanes; aim: 1.9).\n")
    return text


def compile_section(c):
    if not c:
        return ""
    full = "not timed here (`bench/compile_time.sh --full`)"
    if c["full_build_s"]:
        full = f"{c['full_build_s']:.0f} s; by the clock {c['full_build_wall_s']} s on two cores (aim: 600)"
    return ("\n## Compile time\n" + table(
        ["what", "processor time"],
        [[f"a unit with all {c['public_headers']} public headers (aim: 3 s)", f"{c['whole_interface_s']:.1f} s"],
         ["a unit that reads a URDF file and integrates", f"{c['typical_unit_s']:.1f} s"], ["everything", full]]) +
        f"\n{c['compiler']}, -O2.\n")


def compare_section(c):
    if not c:
        return ""
    return ("\n## Speed against error\n`porthos compare examples/ets_vii/scene.toml --budget 40` ([compare.md](compare.md)):\n\n> "
            + c + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=None, help="build folder (default: native-clang, else native)")
    parser.add_argument("--other", type=pathlib.Path, help="a second build, for other registers (CMake option PORTHOS_ARCH)")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "results/bench")
    parser.add_argument("--from", dest="source", type=pathlib.Path, help="measure nothing, read this folder")
    parser.add_argument("--only", help="measure these only: kernels,step,peers,compile,compare")
    parser.add_argument("--page", type=pathlib.Path, default=ROOT / "docs/benchmarks.md")
    a = parser.parse_args()
    build = a.build or next((b for b in (ROOT / "build/native-clang", ROOT / "build/native") if b.exists()), ROOT / "build/native")
    build, out = build.resolve(), (a.source or a.out).resolve()
    out.mkdir(parents=True, exist_ok=True)
    measures = {"kernels": measure_kernels, "step": measure_step, "peers": measure_peers, "compile": measure_compile, "compare": measure_compare}
    wanted = a.only.split(",") if a.only else list(measures)
    unknown = set(wanted) - set(measures)
    if unknown:
        sys.exit(f"page.py: no measurement '{unknown.pop()}'; there are {', '.join(measures)}")
    other = out / "other"
    if not a.source:
        for name in wanted:
            measures[name](build, out)
        if a.other:
            other.mkdir(exist_ok=True)
            for name in [n for n in ("kernels", "step", "peers") if n in wanted]:
                measures[name](a.other.resolve(), other)

    data = load(out / "kernels.json")
    if not data:
        sys.exit(f"page.py: no kernels.json in {out}: build porthos_kernels first (./dev bench)")
    k = Kernels(data)
    context = k.context
    cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.processor())
    load_average = context.get("load_avg") or [0]
    advice = out / "compare/compare.txt"
    compare = advice.read_text().strip().split("\n\n")[-1].replace("\n", " ") if advice.exists() else None
    date = datetime.datetime.fromisoformat(context["date"]).date()
    page = (f"# Benchmarks\nMade by `python3 bench/page.py` ({date}), not by hand; `./dev bench` builds, measures and writes it again.\n\n"
            f"Machine: {cpu}, {context['num_cpus']} cores, {context['porthos_simd']}; load {load_average[0]:.1f} when the run "
            f"began{' (shared with other work)' if load_average[0] > 1 else ''}. "
            f"Porthos by {context['porthos_compiler']}, `{context['porthos_flags']}`. Of repetitions the fastest.\n\n")
    wide = "512" in context["porthos_simd"]
    page += peers_section(load(out / "peers.json"), load(out / "peers_gravity.json"), wide) + "\n" + kernels_section(k)
    shown = other_section(other) if a.other or a.source else ""
    page += step_section(load(out / "step.json")) + shown + scaling_section(k, load_average[0] > 1)
    page += compile_section(load(out / "compile.json")) + compare_section(compare)
    notes = ROOT / "bench/notes.md"
    page += "\n" + notes.read_text() if notes.exists() else ""
    a.page.write_text(page)
    print(f"wrote {a.page}")


if __name__ == "__main__":
    main()
