"""The clip of `siamese.py`, how a network is fitted to it, and how the two trackers are held to each other on it."""
import math
import pathlib
import subprocess
import sys
import threading

import cv2
import numpy as np
import onnxruntime as ort
import torch

WIDTH, HEIGHT, FRAMES, SEED = 320, 240, 30, 29


def clip():
    """Frames of red, green and blue, and the true boxes (left, top, width, height): a square of squares that moves and grows."""
    rng = np.random.default_rng(28)

    def texture(cells):
        coarse = rng.integers(0, 256, (cells, cells, 3)).astype(np.uint8)
        return cv2.resize(coarse, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)

    ground = cv2.addWeighted(texture(9), 0.6, texture(40), 0.4, 0)
    ground[:, :, 0] //= 2
    target = rng.integers((130, 0, 0), (256, 120, 120), (5, 6, 3)).astype(np.uint8)
    target = cv2.resize(target, (60, 50), interpolation=cv2.INTER_NEAREST)
    target = np.dstack([target, np.full((50, 60), 255, np.uint8)])
    frames, truth = [], []
    for k in range(FRAMES):
        grown = 0.8 * 1.014 ** k
        width, height = 60 * grown, 50 * grown
        left, top = 90 + 5.3 * k - width / 2, 95 + 40 * math.sin(k / 7) + 1.1 * k - height / 2
        # The first pixel's middle is half a pixel from the border.
        place = np.array([[grown, 0, left + grown / 2 - 0.5], [0, grown, top + grown / 2 - 0.5]])
        over = cv2.warpAffine(target, place, (WIDTH, HEIGHT))
        share = over[:, :, 3:] / 255.0
        frames.append((ground * (1 - share) + over[:, :, :3] * share).astype(np.uint8))
        truth.append([left, top, width, height])
    return frames, np.array(truth)


def looks(project, frames, truth, count):
    """Has it look at the target from beside it, `count` times: where the target then is, and how large, in its search image."""
    rng = np.random.default_rng(SEED)
    for _ in range(count):
        k = rng.integers(len(frames))
        size = truth[k, 2:] * np.exp(rng.uniform(-0.15, 0.15, 2))
        shift = rng.uniform(-0.6, 0.6, 2) * size
        project.place(np.concatenate([truth[k, :2] + truth[k, 2:] / 2 + shift - size / 2, size]))
        project.track(frames[k])
        scale = project.scale(*size)
        yield -shift * scale, truth[k, 2:] * scale


def fit(project, frames, truth):
    """Measures its normalisations on the clip, and fits its last layers to it."""
    norms = [m for m in project.network.modules() if isinstance(m, torch.nn.BatchNorm2d)]
    for norm in norms:
        norm.reset_running_stats()
        norm.momentum = None
        norm.train()
    project.start(frames[0], truth[0])
    look = lambda: [None for _ in looks(project, frames, truth, 10)]
    look()
    project.network.eval()
    project.start(frames[0], truth[0])
    project.settle(look)
    project.start(frames[0], truth[0])
    seen, heads = {}, list(project.heads())

    def remember(part, given, _):
        # Of each point what the layer's window sees.
        seen[part] = torch.nn.functional.unfold(given[0][:1], part.kernel_size, padding=part.padding)[0].numpy()

    hooks = [part.register_forward_hook(remember) for _, part in heads]
    sums = {part: [0.0, 0.0] for _, part in heads}
    for place, size in looks(project, frames, truth, 40):
        for kind, part in heads:
            wanted, weights = project.wanted(kind, place, size)
            known = np.concatenate([seen[part], np.ones_like(seen[part][:1])])
            sums[part][0] = sums[part][0] + known * weights.ravel() @ known.T
            sums[part][1] = sums[part][1] + known * weights.ravel() @ wanted.reshape(len(wanted), -1).T
    for _, part in heads:
        squares, products = sums[part]
        found = np.linalg.solve(squares + 1e-4 * np.trace(squares) / len(squares) * np.eye(len(squares)), products)
        part.weight.copy_(torch.from_numpy(found[:-1].T.astype(np.float32)).reshape(part.weight.shape))
        part.bias.copy_(torch.from_numpy(found[-1].astype(np.float32)))
    for hook in hooks:
        hook.remove()
    project.finish(look)


def ours(program, description, library, frames, boxes):
    """Our boxes with their scores, and our masks; `boxes` says what is looked for about, none for the last answer."""
    process = subprocess.Popen([program, description, library], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    lines = []
    reader = threading.Thread(target=lambda: lines.extend(process.stdout))
    reader.start()
    process.stdin.write(f"{WIDTH} {HEIGHT}\n".encode())
    for frame, box in zip(frames, boxes):
        line = "-" if box is None else " ".join(repr(float(v)) for v in box)
        process.stdin.write(line.encode() + b"\n" + frame.tobytes())
    process.stdin.close()
    reader.join()
    if process.wait():
        sys.exit("our program failed")
    words = [line.decode().split() for line in lines]
    return np.array([list(map(float, line[:5])) for line in words]), [pixels(line[5]) for line in words if len(line) > 5]


def pixels(text):
    """A mask of VOT's text in the frame: left, top, width, height of what it covers, and runs of other pixels and its own."""
    mask = np.zeros((HEIGHT, WIDTH), bool)
    left, top, width, height, *runs = map(int, text[1:].split(","))
    inside = np.repeat(np.arange(len(runs)) % 2 == 1, runs)
    mask[top:top + height, left:left + width] = np.pad(inside, (0, width * height - len(inside))).reshape(height, width)
    return mask


def apart(a, b):
    """Of each frame the largest difference of an edge."""
    corners = lambda boxes: np.concatenate([boxes[:, :2], boxes[:, :2] + boxes[:, 2:4]], 1)
    return np.abs(corners(np.array(a)) - corners(np.array(b))).max(1)


def compare(name, project, program, folder, frames, truth):
    fit(project, frames, truth)
    project.start(frames[0], truth[0])
    first = project.about()
    (folder / "network.toml").write_text(project.write(folder))
    theirs = [project.track(frame) for frame in frames[1:]]
    print(f"{name}: {sum(p.numel() for p in project.network.parameters())} weights, the target is followed"
          f" to {apart(theirs, truth[1:]).max():.1f} px", flush=True)
    worst, sound = 0.0, True
    for library in [str(pathlib.Path(ort.__file__).parent / "capi"), "rten"]:
        found, masks = ours(program, folder / "network.toml", library, frames, [truth[0], first] + [None] * (FRAMES - 2))
        project.start(frames[0], truth[0])
        steps, plain, other = [], [], []
        for frame, before in zip(frames[1:], [first, *found[:, :4]]):
            for answers, (frame, before) in (plain, (frame, before)), (steps, project.alike(frame, before)):
                project.place(before)
                answers.append(list(project.track(frame)))
            if project.masks:
                mine = masks[len(steps) - 1]
                other.append((np.sum(mine != project.mask), np.sum(mine | project.mask)))
        step, alone = apart(found, steps), apart(found, theirs)
        if steps != plain:
            print(f"    with what it does otherwise at borders and corners a step {apart(found, plain).mean():.2f} px apart in the mean,"
                  f" {apart(found, plain).max():.2f} at most")
        worst = max(worst, step.max())
        print(f"    {'rten' if library == 'rten' else 'onnxruntime'}: a step {step.mean():.2e} px apart in the mean, {np.median(step):.2e} in the"
              f" median, {np.percentile(step, 95):.2e} in 95 of 100, {step.max():.2e} at most; alone {alone.mean():.2e}, {alone.max():.2e};"
              f" scores {found[:, 4].min():.2f} to {found[:, 4].max():.2f}", flush=True)
        if project.masks:
            differing, all_of = np.array(other).T
            share = (differing / np.maximum(all_of, 1)).max()
            print(f"        masks of {all_of.min()} to {all_of.max()} pixels, {differing.sum()} of {all_of.sum()} are others, {share:.1e} of a frame's"
                  " at most", flush=True)
            sound = sound and share <= 0.01 and all_of.min() > 200 and all_of.max() < 0.5 * WIDTH * HEIGHT
    moved, grown = np.abs(found[:, :2] - truth[0, :2]).max(), np.abs(np.log(found[:, 2] / truth[0, 2])).max()
    if moved < 20 or grown < 0.01:
        print(f"    its boxes go no farther than {moved:.1f} px and change by {100 * grown:.1f} %: that proves nothing")
        return False
    return sound and worst <= project.bound
