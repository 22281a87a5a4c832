#!/usr/bin/env python3
"""Renders small scenes with gloss and with Mitsuba 3 and tells what each costs to equal error.

    pip install mitsuba numpy     # the variant llvm_ad_rgb needs LLVM: DRJIT_LIBLLVM_PATH names its library where it is not found
    cargo build --release
    python3 benches/beside_mitsuba.py target/release/gloss [--spp 64] [--seeds 2] [--out DIR] [SCENE ...]

Each scene is described once, below, and written for both. All paths have six reflections and see lamps at the last, which is `max_depth` 8 in
Mitsuba; its sampler is `multijitter`. Two or more seeds tell the errors, which are those of one picture. CPU seconds are user and system: of
gloss the whole process, of Mitsuba the rendering alone, after one that compiles. What a renderer needs to equal error goes with its CPU seconds
times its squared error. Rows are of a table in Markdown; `OUT/NAME-gloss.png` and `OUT/NAME-mitsuba.png` are to be looked at.
"""

import argparse
import itertools
import resource
import subprocess
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
T = mi.ScalarTransform4f

WIDTH, HEIGHT = 320, 240

# ---------------------------------------------------------------------------------------------------------------- materials

# eta and k per channel.
ALUMINIUM = ([1.66, 0.88, 0.52], [9.22, 6.27, 4.84])
COPPER = ([0.2, 0.924, 1.102], [3.912, 2.452, 2.142])
GOLD = ([0.143, 0.375, 1.442], [3.983, 2.386, 1.603])
SILVER = ([0.155, 0.117, 0.138], [4.828, 3.122, 2.147])


def rgb(value):
    return {"type": "rgb", "value": [float(v) for v in value]}


def diffuse(*colour):
    ours = f'type = "diffuse"\ncd = {list(colour)}'
    return ours, {"type": "twosided", "b": {"type": "diffuse", "reflectance": rgb(colour)}}


def metal(ior, alpha):
    eta, k = ior
    ours = f'type = "conductor"\neta = {eta}\nk = {k}\nalpha = {alpha}'
    rough = {"type": "roughconductor", "distribution": "ggx", "alpha": alpha, "eta": rgb(eta), "k": rgb(k)}
    return ours, {"type": "twosided", "b": rough}


def plastic(colour, alpha):
    colour = [float(c) for c in colour]
    ours = f'type = "plastic"\ncd = {colour}\nalpha = {alpha}'
    coat = {"type": "roughplastic", "distribution": "ggx", "alpha": alpha, "int_ior": 1.5, "nonlinear": True}
    return ours, {"type": "twosided", "b": coat | {"diffuse_reflectance": rgb(colour)}}


GLASS = ('type = "dielectric"\neta = 1.5', {"type": "dielectric", "int_ior": 1.5})
MIRROR = (
    'type = "mirror"\nkr = 0.9',
    {"type": "twosided", "b": {"type": "conductor", "material": "none", "specular_reflectance": rgb([0.9] * 3)}},
)
WHITE = diffuse(0.75, 0.75, 0.75)
RED = diffuse(0.6, 0.1, 0.08)

# ------------------------------------------------------------------------------------------------------------------- shapes
# Each is what gloss is told and what Mitsuba is told; the material of the former is filled in later.


def rect_transform(corner, u, v):
    corner, u, v = (np.array(x, float) for x in (corner, u, v))
    n = np.cross(u, v)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = u / 2, v / 2, n / np.linalg.norm(n), corner + u / 2 + v / 2
    return T(m)


def rect(corner, u, v, material):
    ours = f'type = "rect"\ncorner = {corner}\nu = {u}\nv = {v}'
    return ours, {"type": "rectangle", "to_world": rect_transform(corner, u, v)}, material


def sphere(center, radius, material):
    ours = f'type = "sphere"\ncenter = {center}\nradius = {radius}'
    return ours, {"type": "sphere", "center": center, "radius": radius}, material


def box(low, high, material):
    low, high = np.array(low, float), np.array(high, float)
    to_world = T().translate(((low + high) / 2).tolist()) @ T().scale(((high - low) / 2).tolist())
    ours = f'type = "box"\nmin = {low.tolist()}\nmax = {high.tolist()}'
    return ours, {"type": "cube", "to_world": to_world}, material


def mesh(file, size, foot, material):
    """The mesh so large, standing on `foot`."""
    lines = Path(file).read_text().splitlines()
    corners = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float)
    low, high = corners.min(0), corners.max(0)
    scale = size / float((high - low).max())
    middle = np.array([low[0] + high[0], 2 * low[1], low[2] + high[2]]) / 2
    shift = (np.array(foot) - scale * middle).tolist()
    ours = f'type = "obj"\nfile = "{file}"\ntransform = [{{ scale = {scale!r} }}, {{ translate = {shift} }}]'
    theirs = {"type": "obj", "filename": str(file), "face_normals": True, "to_world": T().translate(shift) @ T().scale(scale)}
    return ours, theirs, material


# ------------------------------------------------------------------------------------------------------------------- lights


def emitting(theirs, radiance):
    black = {"type": "diffuse", "reflectance": rgb([0, 0, 0])}
    return theirs | {"e": {"type": "area", "radiance": rgb(radiance)}, "b": black}


def lamp(corner, u, v, radiance):
    """A rectangle that shines along `u x v`."""
    ours = f'[[lights]]\ntype = "rect"\ncorner = {corner}\nu = {u}\nv = {v}\nradiance = {radiance}'
    return ours, emitting({"type": "rectangle", "to_world": rect_transform(corner, u, v)}, radiance)


def lamp_down(x, y, z, size, radiance):
    return lamp([x - size / 2, y, z - size / 2], [size, 0, 0], [0, 0, size], radiance)


def lamp_up(x, y, z, size, radiance):
    return lamp([x - size / 2, y, z + size / 2], [size, 0, 0], [0, 0, -size], radiance)


def ball_lamp(center, radius, radiance):
    ours = f'[[lights]]\ntype = "sphere"\ncenter = {center}\nradius = {radius}\nradiance = {radiance}'
    return ours, emitting({"type": "sphere", "center": center, "radius": radius}, radiance)


def mesh_lamp(file, size, foot, radiance):
    ours, theirs, _ = mesh(file, size, foot, None)
    return f'[materials.lamp]\ntype = "emissive"\nradiance = {radiance}\n[[shapes]]\n{ours}\nmaterial = "lamp"', emitting(theirs, radiance)


def sky(radiance):
    return f'[environment]\ntype = "constant"\nradiance = {radiance}', {"type": "constant", "radiance": rgb(radiance)}


def image(file):
    return f'[environment]\ntype = "image"\nfile = "{file}"', {"type": "envmap", "filename": str(file)}


def directions(width, height):
    """The directions of a latitude-longitude image whose middle is -z, by rows."""
    phi = (np.arange(width) + 0.5) / width * 2 * np.pi
    theta = (np.arange(height) + 0.5) / height * np.pi
    phi, theta = np.meshgrid(phi, theta)
    return np.stack([-np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1)


def write_studio(file):
    """A dim room with three softboxes."""
    d = directions(1024, 512)
    picture = np.full(d.shape, 0.03)
    for towards, half_angle, radiance in (([1, 1.2, 0.6], 14, 60), ([-1.2, 0.5, 0.3], 9, 40), ([0.2, 0.6, -1], 6, 30)):
        towards = np.array(towards) / np.linalg.norm(towards)
        picture[d @ towards > np.cos(np.radians(half_angle))] = radiance
    mi.Bitmap(picture.astype(np.float32)).write(str(file))


def write_sunset(file):
    """A bright horizon and a low sun."""
    d = directions(1024, 512)
    up = d[..., 1:2]
    picture = np.where(up > 0, np.array([0.25, 0.35, 0.6]) + np.array([1.2, 0.6, 0.2]) * np.exp(-6 * np.abs(up)), 0.05)
    towards = np.array([0.8, 0.25, 0.5]) / np.linalg.norm([0.8, 0.25, 0.5])
    picture[d @ towards > np.cos(np.radians(0.8))] = [9000, 6000, 3000]
    mi.Bitmap(picture.astype(np.float32)).write(str(file))


# ------------------------------------------------------------------------------------------------------------------- scenes


def room(wall=WHITE, half_width=2, height=2.5, back=-3, front=3, **sides):
    w, h, b, f = half_width, height, back, front
    faces = {
        "floor": ([-w, 0, f], [2 * w, 0, 0], [0, 0, b - f]),
        "ceiling": ([-w, h, b], [2 * w, 0, 0], [0, 0, f - b]),
        "back": ([-w, 0, b], [2 * w, 0, 0], [0, h, 0]),
        "front": ([w, 0, f], [-2 * w, 0, 0], [0, h, 0]),
        "right": ([w, 0, b], [0, 0, f - b], [0, h, 0]),
        "left": ([-w, 0, f], [0, 0, b - f], [0, h, 0]),
    }
    return [rect(*face, sides.get(name, wall)) for name, face in faces.items()]


def floor(half, material):
    return rect([-half, 0, half], [2 * half, 0, 0], [0, 0, -2 * half], material)


ROOM_CAMERA = ([0.9, 1.3, 2.7], [-0.3, 0.9, -1], 55)
TABLE_CAMERA = ([0.2, 0.8, 3], [0, 0.35, 0], 32)
BALLS = [metal(SILVER, 0.05), metal(GOLD, 0.2), RED, plastic([0.1, 0.5, 0.2], 0.1)]


def scenes(knot, studio, sunset):
    """Of each scene its camera (eye, what it looks at, degrees from lower to upper edge), its shapes, its lights."""
    rng = np.random.RandomState(7)

    def balls():
        places = ([float(x) for x in rng.uniform([-2, -3], [2, 1.5])] for _ in itertools.count())
        return [
            sphere([x, radius, z], radius, BALLS[i % 4])
            for i, (radius, (x, z)) in enumerate(zip(rng.uniform(0.06, 0.16, 150).tolist(), places))
        ]

    def lamps(count, x, y, z, radiance):
        def one():
            place = [float(rng.uniform(*span)) for span in (x, y, z)]
            return place, [float(c) for c in rng.uniform(*radiance, 3)]

        return [one() for _ in range(count)]

    of_table = lambda shapes, lights: (TABLE_CAMERA, [floor(5, diffuse(0.45, 0.42, 0.4))] + shapes, lights)
    of_room = lambda shapes, lights, **sides: (ROOM_CAMERA, room(right=RED, **sides) + shapes, lights)
    ceiling_lamp = lamp_down(0, 2.45, -1, 0.6, [20, 18, 15])
    yield "corridor of two mirrors, metal floor", (
        ([0.3, 1.2, 2.5], [0, 1, -1], 60),
        room(left=MIRROR, right=MIRROR, floor=metal(COPPER, 0.3))
        + [sphere([-0.6, 0.4, -1], 0.4, diffuse(0.7, 0.2, 0.1)), sphere([0.5, 0.3, -0.3], 0.3, metal(GOLD, 0.15))],
        [ceiling_lamp],
    )
    yield "metal floor under 100 small lamps", (
        ([0, 1.6, 3.6], [0, 0.3, -0.5], 45),
        [
            floor(6, metal(ALUMINIUM, 0.1)),
            sphere([-0.8, 0.4, 0], 0.4, metal(GOLD, 0.05)),
            sphere([0.2, 0.4, -0.6], 0.4, plastic([0.1, 0.3, 0.6], 0.1)),
            sphere([1.1, 0.4, 0.2], 0.4, diffuse(0.6, 0.6, 0.6)),
        ],
        [sky([0.02, 0.02, 0.03])]
        + [lamp_down(*place, 0.12, radiance) for place, radiance in lamps(100, (-4, 4), (1.5, 3), (-5, 2), (5, 60))],
    )
    yield "room with metal floor, golden knot", of_room(
        [mesh(knot, 1.6, [0, 0, -0.8], metal(GOLD, 0.2))],
        [ball_lamp([1.2, 1.9, 0.5], 0.15, [30, 28, 25])],
        floor=metal(ALUMINIUM, 0.15),
    )
    yield "knot of glass, studio", (
        ([0.1, 0.7, 2.6], [0, 0.4, 0], 30),
        [
            floor(3, diffuse(0.5, 0.5, 0.5)),
            mesh(knot, 1.2, [-0.1, 0, -0.2], GLASS),
            sphere([0.6, 0.15, 0.5], 0.15, metal(SILVER, 0.05)),
        ],
        [image(studio)],
    )
    yield "knots of copper and clay, ball of glass, low sun", of_table(
        [
            mesh(knot, 1.0, [-0.5, 0, 0], metal(COPPER, 0.25)),
            mesh(knot, 1.0, [0.6, 0, -0.3], diffuse(0.6, 0.5, 0.3)),
            sphere([0.1, 0.15, 0.6], 0.15, GLASS),
        ],
        [image(sunset)],
    )
    yield "room lit by a lamp behind a wall", of_room(
        [
            rect([-2, 0, -1.8], [3.4, 0, 0], [0, 2.5, 0], WHITE),
            sphere([-0.7, 0.45, -0.9], 0.45, metal(GOLD, 0.1)),
            box([0.4, 0, -1.2], [1.0, 0.8, -0.6], WHITE),
        ],
        [lamp_down(0, 2.4, -2.5, 0.5, [60, 55, 50])],
    )
    yield "room with a polished plastic floor, balls", (
        ([0.9, 1.3, 2.7], [-0.3, 0.7, -1], 55),
        room(left=diffuse(0.2, 0.4, 0.6), floor=plastic([0.3, 0.2, 0.1], 0.05))
        + [sphere([-0.7, 0.45, -1], 0.45, metal(SILVER, 0.02)), sphere([0.4, 0.3, -0.3], 0.3, plastic([0.6, 0.1, 0.1], 0.2))],
        [lamp_down(-0.5, 2.45, -1, 0.4, [30, 28, 25]), lamp_down(1, 2.45, 1, 0.4, [20, 25, 30])],
    )
    yield "150 balls of metals, plastic and clay, even sky and a lamp", (
        ([0, 1.5, 3.6], [0, 0.1, -0.4], 40),
        [floor(5, WHITE)] + balls(),
        [sky([0.3, 0.35, 0.4]), ball_lamp([1.2, 2, 0.3], 0.3, [25, 24, 22])],
    )
    yield "room lit by way of its ceiling, knot of plastic", of_room(
        [mesh(knot, 1.4, [0, 0, -0.8], plastic([0.2, 0.5, 0.3], 0.15))],
        [lamp_up(x, 1.6, -2.5, 0.3, [60, 50, 40]) for x in (-1.5, 1.5)],
        floor=diffuse(0.4, 0.3, 0.2),
    )
    yield "room with 150 such balls", of_room(balls(), [ceiling_lamp])
    yield "room with 12 knots of metals, plastic and clay", of_room(
        [
            mesh(knot, size, [float(rng.uniform(-1.6, 1.6)), 0, float(rng.uniform(-2.6, 1.2))], BALLS[i % 4])
            for i, size in enumerate(rng.uniform(0.4, 0.9, 12).tolist())
        ],
        [ceiling_lamp],
    )
    yield "room lit by a knot", of_room(
        [
            sphere([-0.7, 0.45, -1.2], 0.45, metal(GOLD, 0.1)),
            sphere([0.5, 0.35, -0.5], 0.35, plastic([0.1, 0.3, 0.6], 0.1)),
            box([0.9, 0, -2.2], [1.6, 1.0, -1.4], diffuse(0.4, 0.6, 0.3)),
        ],
        [mesh_lamp(knot, 0.5, [0.3, 1.5, -1], [18, 15, 10])],
    )
    yield "knot of copper under 1000 small lamps", (
        ([0, 1.4, 3.6], [0, 0.3, -0.5], 45),
        [
            floor(8, diffuse(0.5, 0.5, 0.5)),
            mesh(knot, 1.4, [-0.4, 0, -0.3], metal(COPPER, 0.15)),
            sphere([0.8, 0.3, 0.3], 0.3, plastic([0.5, 0.1, 0.1], 0.1)),
        ],
        [sky([0.01, 0.01, 0.02])]
        + [ball_lamp(place, 0.03, radiance) for place, radiance in lamps(1000, (-5, 5), (0.8, 3), (-6, 2), (5, 80))],
    )
    yield "six balls of plastic, studio", (
        ([0, 1.1, 4], [0, 0.35, 0], 34),
        [floor(5, diffuse(0.6, 0.6, 0.6))]
        + [
            sphere([-1.4 + 0.56 * i, 0.25, 0.2 * (i % 2)], 0.25, plastic(rng.uniform(0.05, 0.8, 3), alpha))
            for i, alpha in enumerate((0.02, 0.05, 0.1, 0.2, 0.3, 0.4))
        ],
        [image(studio)],
    )
    yield "room with a ball of glass and one of silver", (
        ([0, 1.2, 2.9], [0, 1.1, -1], 50),
        room(half_width=1.5, height=2.4, back=-2.5, left=RED, right=diffuse(0.1, 0.5, 0.1))
        + [sphere([-0.55, 0.5, -1.3], 0.5, GLASS), sphere([0.6, 0.4, -0.6], 0.4, metal(SILVER, 0.02))],
        [lamp_down(0, 2.38, -1, 0.6, [15, 15, 15])],
    )
    yield "knots of gold and plastic, ball of silver, small sun", of_table(
        [
            mesh(knot, 1.0, [-0.5, 0, 0], metal(GOLD, 0.15)),
            mesh(knot, 1.0, [0.6, 0, -0.3], plastic([0.5, 0.2, 0.1], 0.1)),
            sphere([0.1, 0.15, 0.6], 0.15, metal(SILVER, 0.05)),
        ],
        [sky([0.15, 0.2, 0.3]), ball_lamp([6, 10, 7], 0.15, [9000, 8500, 8000])],
    )


# ---------------------------------------------------------------------------------------------------------------- rendering


def for_gloss(scene):
    (eye, at, fov), shapes, lights = scene
    settings = 'max_depth = 6\nat_max_depth = "black"'
    text = [
        f"[settings]\n{settings}\n[camera]\neye = {eye}\nlook_at = {at}\nfov_deg = {fov}\nresolution = [{WIDTH}, {HEIGHT}]"
    ]
    names = {}
    for ours, _, (material, _) in shapes:
        name = names.setdefault(material, f"m{len(names)}")
        text.append(f'[[shapes]]\n{ours}\nmaterial = "{name}"')
    text += [ours for ours, _ in lights]
    text += [f"[materials.{name}]\n{material}" for material, name in names.items()]
    return "\n".join(text) + "\n"


def for_mitsuba(scene, spp):
    (eye, at, fov), shapes, lights = scene
    film = {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"}, "pixel_format": "rgb"}
    sensor = {"type": "perspective", "fov": fov, "fov_axis": "y", "film": film}
    sensor["to_world"] = T().look_at(origin=eye, target=at, up=[0, 1, 0])
    sensor["sampler"] = {"type": "multijitter", "sample_count": spp}
    described = {"type": "scene", "integrator": {"type": "path", "max_depth": 8, "rr_depth": 5}, "sensor": sensor}
    for i, (_, theirs, (_, material)) in enumerate(shapes):
        described[f"shape{i}"] = theirs | {"b": material}
    for i, (_, theirs) in enumerate(lights):
        described[f"light{i}"] = theirs
    return mi.load_dict(described)


def cpu(who):
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def timed(who, render, seeds):
    """Pictures of these seeds and the CPU seconds of one."""
    before = cpu(who)
    pictures = [render(seed) for seed in seeds]
    return np.array(pictures, float)[..., :3], (cpu(who) - before) / len(seeds)


def errors(pictures):
    """Mean squared error of one picture: as it is, without the worst thousandth of the pixels beyond the next, and relative."""
    mean = pictures.mean(0)
    variance = pictures.var(0, ddof=1).mean(-1)
    capped = np.minimum(variance, np.quantile(variance, 0.999))
    relative = variance / ((mean**2).mean(-1) + 1e-2 * mean.mean() ** 2)
    return np.array([variance.mean(), capped.mean(), relative.mean()])


def write_png(picture, scale, file):
    tone = np.clip(picture / scale, 0, 1) ** (1 / 2.2)
    mi.Bitmap((255 * tone).astype(np.uint8)).write(str(file))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("gloss", type=Path)
    parser.add_argument("scene", nargs="*", help="part of a name: only those")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("target/beside-mitsuba"))
    args = parser.parse_intermixed_args()
    if args.seeds < 2:
        parser.error("--seeds: errors need at least 2")
    gloss, out = args.gloss.resolve(), args.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    knot, studio, sunset = out / "knot.obj", out / "studio.exr", out / "sunset.exr"
    subprocess.run([gloss, "gen", "knot", "--triangles", "48000", "-o", knot], check=True, capture_output=True)
    write_studio(studio)
    write_sunset(sunset)
    seeds = range(1, args.seeds + 1)
    print("| scene | CPU s, gloss / Mitsuba | RMSE | CPU s to equal RMSE | capped | to equal relMSE | mean, gloss by Mitsuba |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    ratios = []
    for name, scene in scenes(knot, studio, sunset):
        if args.scene and not any(part in name for part in args.scene):
            continue
        file = out / "-".join("".join(c if c.isalnum() else " " for c in name).split())
        toml, exr = file.with_suffix(".toml"), file.with_suffix(".exr")
        toml.write_text(for_gloss(scene))

        def with_gloss(seed):
            command = [gloss, "render", toml, "-o", exr, "--spp", str(args.spp), "--seed", str(seed), "--quiet"]
            subprocess.run(command, check=True)
            return np.array(mi.Bitmap(str(exr)))

        loaded = for_mitsuba(scene, args.spp)
        with_mitsuba = lambda seed: np.array(mi.render(loaded, spp=args.spp, seed=seed))
        with_mitsuba(0)
        theirs, their_cpu = timed(resource.RUSAGE_SELF, with_mitsuba, seeds)
        ours, our_cpu = timed(resource.RUSAGE_CHILDREN, with_gloss, seeds)
        scale = 2.5 * theirs.mean()
        write_png(ours.mean(0), scale, f"{file}-gloss.png")
        write_png(theirs.mean(0), scale, f"{file}-mitsuba.png")
        our_errors, their_errors = errors(ours), errors(theirs)
        ratio = our_cpu / their_cpu * our_errors / their_errors
        ratios.append(ratio)
        row = [name, f"{our_cpu:.1f} / {their_cpu:.1f}", f"{our_errors[0] ** 0.5:.4f} / {their_errors[0] ** 0.5:.4f}"]
        row += [f"{r:.2f}" for r in ratio] + [f"{100 * (ours.mean() / theirs.mean() - 1):+.2f} %"]
        print("| " + " | ".join(row) + " |", flush=True)
    if ratios:
        mean = np.exp(np.log(ratios).mean(0))
        print("| geometric mean | | | " + " | ".join(f"{r:.2f}" for r in mean) + " | |")


if __name__ == "__main__":
    main()
