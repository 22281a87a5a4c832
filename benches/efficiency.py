#!/usr/bin/env python3
"""Efficiency of each choice of estimator beside the default, on scenes: 1 / (relMSE x CPU seconds).

    benches/efficiency.py [--gloss target/release/gloss] [--scenes scenes/a.toml,...] [--spp 16] [--seeds 4]
                          [--size 200x150] [--only default,light,...]

Needs Python's standard library only. Every choice renders every scene with the same numbers of samples and several
seeds, interleaved seed by seed, so that a busy machine slows all alike. relMSE is the variance over the seeds relative
to the mean of all pictures of the scene (squared, plus a hundredth of the square of the picture's mean), which is right
as long as all choices have the same mean: a choice whose picture's mean is off by more than 5 standard errors is
marked with an exclamation mark. CPU seconds are those of the process (user + system) less those of a render of one
sample, in the mean of the seeds, since a pilot may decide otherwise from seed to seed. Numbers above 1 are better than the default.
"""
import argparse
import os
import struct
import subprocess
import sys
import tempfile
import zlib

CHOICES = {
    "default": [],
    "light": ["--direct-light", "light"],
    "lobe": ["--direct-light", "lobe"],
    "one ray": ["--glossy-samples", "any=1"],
    "split 2": ["--glossy-samples", "any=2"],
    "split 4": ["--glossy-samples", "any=4"],
    "split 9": ["--glossy-samples", "any=9"],
    "split auto": ["--glossy-samples", "auto"],
    "blue-noise": ["-D", 'settings.sampler="blue-noise"'],
    "independent": ["-D", 'settings.sampler="independent"'],
    "adaptive": ["--adaptive"],
    "roulette from 1": ["-D", "settings.roulette_from=1"],
    "from 4": ["-D", "settings.roulette_from=4"],
    "from 1000": ["-D", "settings.roulette_from=1000"],
}


def read_exr(path):
    """R, G and B of a picture that gloss wrote: one part, scan lines, ZIP, 32-bit floats."""
    data = open(path, "rb").read()
    at, header = 8, {}
    while data[at] != 0:
        name, at = text(data, at)
        _, at = text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        header[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    at += 1
    x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    names, here = [], 0
    while header["channels"][here] != 0:
        name, here = text(header["channels"], here)
        names.append(name)
        here += 16
    lines = {2: 1, 3: 16}[header["compression"][0]]
    planes = {name: [] for name in "RGB"}
    for offset in struct.unpack_from("<%dQ" % -(-height // lines), data, at):
        y, size = struct.unpack_from("<2i", data, offset)
        rows = min(lines, y1 - y + 1)
        raw, whole = data[offset + 8 : offset + 8 + size], rows * width * 4 * len(names)
        if size < whole:
            raw = unpredicted(zlib.decompress(raw))
        for row in range(rows):
            for i, name in enumerate(names):
                if name in planes:
                    planes[name].extend(struct.unpack_from("<%df" % width, raw, (row * len(names) + i) * width * 4))
    return [planes[name] for name in "RGB"]


def text(data, at):
    end = data.index(0, at)
    return data[at:end].decode("latin-1"), end + 1


def unpredicted(packed):
    """Undoes the differences and the interleaving that precede EXR's deflate."""
    out, last = bytearray(packed), packed[0]
    for i in range(1, len(out)):
        last = out[i] = (last + out[i] - 128) & 255
    half = (len(out) + 1) // 2
    result = bytearray(len(out))
    result[0::2], result[1::2] = out[:half], out[half:]
    return bytes(result)


def render(options, scene, flags, spp, seed, directory):
    """CPU seconds and the picture."""
    path = os.path.join(directory, "a.exr")
    command = [options.gloss, "render", scene, "-o", path, "--quiet", "--resolution", options.size]
    command += ["--threads", "1", "--seed", str(seed), "--spp", str(spp)] + flags
    process = subprocess.Popen(command)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit("failed: " + " ".join(command))
    return usage.ru_utime + usage.ru_stime, [v for plane in read_exr(path) for v in plane]


def measure(options, scene, choices, directory):
    """For each choice its relMSE, CPU seconds, and by how many standard errors its mean is off."""
    names = list(choices)
    seconds, pictures = {n: [] for n in names}, {n: [] for n in names}
    load, _ = min((render(options, scene, [], 1, 0, directory) for _ in range(3)), key=lambda run: run[0])
    for seed in range(options.seeds):
        for name in names:
            flags = list(choices[name])
            time, picture = render(options, scene, flags, options.spp, 1000 * (names.index(name) + 1) + seed, directory)
            seconds[name].append(time - load)
            pictures[name].append(picture)
    every = [p for name in names for p in pictures[name]]
    mean = [sum(values) / len(every) for values in zip(*every)]
    level = sum(mean) / len(mean)
    weight = [1 / (m * m + 0.01 * level * level) for m in mean]
    found = {}
    for name in names:
        runs = pictures[name]
        total, variance = 0.0, 0.0
        for values, w in zip(zip(*runs), weight):
            middle = sum(values) / len(values)
            square = sum((v - middle) ** 2 for v in values) / (len(values) - 1)
            total, variance = total + w * square, variance + square
        own = sum(sum(run) / len(run) for run in runs) / len(runs)
        # Three channels of a pixel have about the same error.
        error = (3 * variance / len(runs)) ** 0.5 / len(mean)
        found[name] = (total / len(mean), sum(seconds[name]) / len(seconds[name]), (own - level) / max(error, 1e-9 * level))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gloss", default="target/release/gloss")
    parser.add_argument("--scenes", default="boxes,checker-sphere,cornell-glossy,lemon,mesh,mirror-room,rim")
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--size", default="200x150")
    parser.add_argument("--only", default=",".join(CHOICES))
    parser.add_argument("--choice", action="append", default=[], metavar="NAME=FLAG FLAG ...")
    options = parser.parse_args()
    choices = {name: CHOICES[name] for name in options.only.split(",") if name}
    for choice in options.choice:
        name, flags = choice.split("=", 1)
        choices[name] = flags.split()
    print("| scene | relMSE, CPU s | " + " | ".join(n for n in choices if n != "default") + " |")
    print("|---" * (len(choices) + 1) + "|")
    with tempfile.TemporaryDirectory() as directory:
        for scene in options.scenes.split(","):
            path = scene if scene.endswith(".toml") else "scenes/%s.toml" % scene
            found = measure(options, path, choices, directory)
            error, time, _ = found["default"]
            cells = []
            for name in choices:
                if name != "default":
                    e, t, off = found[name]
                    value = "%.2f" % (error * time / (e * t)) if e > 0 and t > 0 else "-"
                    cells.append(value + ("!" if abs(off) > 5 else ""))
            name = os.path.basename(path)[:-5] if "/" not in scene else os.path.basename(os.path.dirname(path))
            print("| %s | %.3g, %.2f | %s |" % (name, error, time, " | ".join(cells)), flush=True)


if __name__ == "__main__":
    main()
