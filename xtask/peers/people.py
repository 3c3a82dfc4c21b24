#!/usr/bin/env python3
"""Several people by a detector alone, motion unless --detect names another: `pursuit track … --many` on PETS09-S2L1, judged by TrackEval.

usage (from the repository): cargo xtask peers people CLIP_FOLDER [--detect NAME] [--set KEY=VALUE …] [--vary NAME …]
       or, of a trajectory that is there: people.py --trajectory trajectory.txt CLIP_FOLDER
needs, from PyPI: trackeval, numpy, opencv-python-headless (which decodes the clip where there is no ffmpeg)

CLIP_FOLDER holds `vtest.avi` and `gt_mot.txt` (frame, id, left, top, width, height; both counted from 1). Printed are MOTA, IDF1
and HOTA, and what they are made of; overlap of one half makes a match for the first two. Exits with 1 when MOTA is below --bar.
It may also hold `input` and `frames.csv` (CDnet's office): then the overlap with the person's boxes is printed, and how long a false
target lives in the empty lead-in. --vary follows the clip changed: jpeg, mpeg4, half, three_quarters, darker, brighter, mirrored,
reversed, or all of them.
"""
import argparse, csv, math, os, subprocess, sys, tempfile
import numpy as np
import trackeval


def read(path):
    """{frame: [(id, left, top, width, height)]}"""
    rows = {}
    for line in open(path):
        cells = [float(v) for v in line.split(',')]
        rows.setdefault(int(cells[0]), []).append((int(cells[1]), *cells[2:6]))
    return rows


def overlaps(a, b):
    a, b = np.array([r[1:] for r in a]).reshape(-1, 4), np.array([r[1:] for r in b]).reshape(-1, 4)
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, :2] + a[:, None, 2:], b[None, :, :2] + b[None, :, 2:])
    both = np.prod(np.clip(high - low, 0, None), axis=2)
    return both / (np.prod(a[:, 2:], axis=1)[:, None] + np.prod(b[:, 2:], axis=1)[None] - both)


def judge(truth, said):
    """What TrackEval wants, and what it says."""
    names = [{i: k for k, i in enumerate(sorted({r[0] for rows in side.values() for r in rows}))} for side in (truth, said)]
    frames = range(1, max(truth) + 1)
    per = [[side.get(f, []) for f in frames] for side in (truth, said)]
    ids = [[np.array([n[r[0]] for r in rows], int) for rows in side] for side, n in zip(per, names)]
    data = dict(num_timesteps=len(frames), gt_ids=ids[0], tracker_ids=ids[1], num_gt_ids=len(names[0]), num_tracker_ids=len(names[1]),
                num_gt_dets=sum(map(len, ids[0])), num_tracker_dets=sum(map(len, ids[1])),
                similarity_scores=[overlaps(a, b) for a, b in zip(*per)])
    quiet = {'PRINT_CONFIG': False}
    clear = trackeval.metrics.CLEAR(quiet).eval_sequence(data)
    identity = trackeval.metrics.Identity(quiet).eval_sequence(data)
    hota = trackeval.metrics.HOTA(quiet).eval_sequence(data)
    mean = lambda name: float(np.mean(hota[name]))
    return dict(MOTA=clear['MOTA'], IDF1=identity['IDF1'], HOTA=mean('HOTA'), DetA=mean('DetA'), AssA=mean('AssA'), MOTP=clear['MOTP'],
                recall=clear['CLR_Re'], precision=clear['CLR_Pr'], switches=int(clear['IDSW']), misses=int(clear['CLR_FN']),
                false_alarms=int(clear['CLR_FP']), targets=len(names[1]))


def pictures_of(folder):
    """The clip's frames: our own reader needs ffmpeg for the codec of vtest.avi."""
    import cv2
    inputs = os.path.join(folder, 'input')
    if os.path.isdir(inputs):
        for name in sorted(os.listdir(inputs)):
            yield cv2.imread(os.path.join(inputs, name))
        return
    video = cv2.VideoCapture(os.path.join(folder, 'vtest.avi'))
    while True:
        there, image = video.read()
        if not there:
            return
        yield image


# What is done to a frame, the scale of its boxes.
VARIATIONS = {
    'as it is': (lambda cv2, image: image, 1.0),
    'jpeg': (lambda cv2, image: cv2.imdecode(cv2.imencode('.jpg', image, [cv2.IMWRITE_JPEG_QUALITY, 25])[1], 1), 1.0),
    'mpeg4': (lambda cv2, image: image, 1.0),
    'half': (lambda cv2, image: cv2.resize(image, None, fx=.5, fy=.5, interpolation=cv2.INTER_AREA), 0.5),
    'three_quarters': (lambda cv2, image: cv2.resize(image, None, fx=.75, fy=.75, interpolation=cv2.INTER_AREA), 0.75),
    'darker': (lambda cv2, image: cv2.convertScaleAbs(image, alpha=.7), 1.0),
    'brighter': (lambda cv2, image: cv2.convertScaleAbs(image, alpha=1.3), 1.0),
    'mirrored': (lambda cv2, image: image[:, ::-1], 1.0),
    'reversed': (lambda cv2, image: image, 1.0),
}


def write(folder, into, name):
    """Writes the varied frames; how many there are, and their width."""
    import cv2
    change, _ = VARIATIONS[name]
    images = [change(cv2, image) for image in pictures_of(folder)]
    if name == 'mpeg4':
        height, width = images[0].shape[:2]
        coded = os.path.join(into, 'coded.mp4')
        video = cv2.VideoWriter(coded, cv2.VideoWriter_fourcc(*'mp4v'), 25, (width, height))
        for image in images:
            video.write(image)
        video.release()
        video, images = cv2.VideoCapture(coded), []
        while (read := video.read())[0]:
            images.append(read[1])
        os.remove(coded)
    if name == 'reversed':
        images.reverse()
    for count, image in enumerate(images):
        cv2.imwrite(os.path.join(into, f'{count:06d}.png'), image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return len(images), images[0].shape[1]


def varied(box, name, width):
    """A box as the varied frames show it; `width` is theirs."""
    left, top, w, h = (v * VARIATIONS[name][1] for v in box)
    return (width - left - w if name == 'mirrored' else left, top, w, h)


def people(folder, name, trajectory, count, width):
    """The figures of vtest.avi; boxes of both files count pixels from 1."""
    at = lambda frame: count + 1 - frame if name == 'reversed' else frame
    moved = lambda r: (r[0], *varied((r[1] - 1, r[2] - 1, *r[3:]), name, width))
    truth = {at(f): [moved(r) for r in rows] for f, rows in read(os.path.join(folder, 'gt_mot.txt')).items()}
    said = {f: [(r[0], r[1] - 1, r[2] - 1, *r[3:]) for r in rows] for f, rows in read(trajectory).items()}
    return judge(truth, said)


def office(folder, name, trajectory, count, width):
    """The figures of the office, frames 40 to 440; the lead-in is frames 0 to 25."""
    at = lambda frame: count - 1 - frame if name == 'reversed' else frame
    rows = [[float(v) for v in row[2:6]] for row in list(csv.reader(open(os.path.join(folder, 'frames.csv'))))[1:count + 1]]
    said = read(trajectory)
    overlap, tracked, standing = [], [], []
    for frame, box in enumerate(rows):
        if 40 <= frame <= 440 and not math.isnan(box[0]):
            here = [(r[0], r[1] - 1, r[2] - 1, *r[3:]) for r in said.get(at(frame) + 1, [])]
            best = max(overlaps([(0, *varied(box, name, width))], here)[0]) if here else 0.0
            overlap.append(best)
            tracked.append(bool(here))
            if frame >= 150:
                standing.append(bool(here))
    lives = {}
    for frame in range(26):
        for row in said.get(at(frame) + 1, []):
            lives[row[0]] = lives.get(row[0], 0) + 1
    mean = lambda values: float(np.mean(values))
    return dict(overlap=mean(overlap), tracked=mean(tracked), standing=mean(standing), false_life=max(lives.values(), default=0))


def follow(a, name, temporary):
    """Runs the program over the varied clip and judges it."""
    pictures, out = os.path.join(temporary, 'in'), os.path.join(temporary, 'out')
    os.mkdir(pictures)
    count, width = write(a.folder, pictures, name)
    indoors = os.path.isdir(os.path.join(a.folder, 'input'))
    command = [os.environ['PURSUIT'], 'track', pictures, '--fps', '25' if indoors else '7', '--detect', a.detect, '--many', '--format', 'mot', '--no-video', '--quiet', '--out', out]
    command += [w for s in a.set for w in ('--set', s)] + (['--tracker', a.tracker] if a.tracker else [])
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return (office if indoors else people)(a.folder, name, os.path.join(out, 'trajectory.txt'), count, width)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('folder')
    parser.add_argument('--trajectory', help='judge this file (MOTChallenge) in place of running the program')
    parser.add_argument('--detect', default='motion', help='as the option of `pursuit track`')
    parser.add_argument('--set', action='append', default=[], metavar='KEY=VALUE')
    parser.add_argument('--tracker', help='as the option of `pursuit track`')
    parser.add_argument('--vary', action='append', default=[], choices=[*VARIATIONS, 'all'])
    parser.add_argument('--bar', type=float, default=.50, help='least MOTA')
    a = parser.parse_args()
    below = False
    for name in list(VARIATIONS) if 'all' in a.vary else a.vary or ['as it is']:
        with tempfile.TemporaryDirectory() as temporary:
            if a.trajectory:
                figures = people(a.folder, name, a.trajectory, 0, 0)
            else:
                figures = follow(a, name, temporary)
        print(f'{name}: ' + '  '.join(f'{k} {v:.3f}' if isinstance(v, float) else f'{k} {v}' for k, v in figures.items()), flush=True)
        below |= figures.get('MOTA', 1.0) < a.bar
    sys.exit(int(below))


if __name__ == '__main__':
    main()
