#!/usr/bin/env python3
"""Several people by motion alone: `pursuit track … --detect motion --many` on PETS09-S2L1, judged by TrackEval.

usage (from the repository): cargo xtask peers people CLIP_FOLDER [--set KEY=VALUE …]
       or, of a trajectory that is there: people.py --trajectory trajectory.txt CLIP_FOLDER
needs, from PyPI: trackeval, numpy, opencv-python-headless (which decodes the clip where there is no ffmpeg)

CLIP_FOLDER holds `vtest.avi` and `gt_mot.txt` (frame, id, left, top, width, height; both counted from 1). Printed are MOTA, IDF1
and HOTA, and what they are made of; overlap of one half makes a match for the first two. Exits with 1 when MOTA is below --bar.
"""
import argparse, os, subprocess, sys, tempfile
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


def frames_of(clip, folder):
    """The clip's frames as pictures: our own reader needs ffmpeg for its codec."""
    import cv2
    video, count = cv2.VideoCapture(clip), 0
    while True:
        there, image = video.read()
        if not there:
            return folder
        cv2.imwrite(os.path.join(folder, f'{count:06d}.png'), image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        count += 1


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('folder')
    parser.add_argument('--trajectory', help='judge this file (MOTChallenge) in place of running the program')
    parser.add_argument('--set', action='append', default=[], metavar='KEY=VALUE')
    parser.add_argument('--tracker', help='as the option of `pursuit track`')
    parser.add_argument('--bar', type=float, default=.50, help='least MOTA')
    a = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        trajectory = a.trajectory
        if not trajectory:
            pictures, out = os.path.join(temporary, 'in'), os.path.join(temporary, 'out')
            os.mkdir(pictures)
            frames_of(os.path.join(a.folder, 'vtest.avi'), pictures)
            command = [os.environ['PURSUIT'], 'track', pictures, '--fps', '7', '--detect', 'motion', '--many', '--format', 'mot', '--no-video', '--quiet', '--out', out]
            command += [w for s in a.set for w in ('--set', s)] + (['--tracker', a.tracker] if a.tracker else [])
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            trajectory = os.path.join(out, 'trajectory.txt')
        figures = judge(read(os.path.join(a.folder, 'gt_mot.txt')), read(trajectory))
    print('  '.join(f'{k} {v:.3f}' if isinstance(v, float) else f'{k} {v}' for k, v in figures.items()))
    sys.exit(int(figures['MOTA'] < a.bar))


if __name__ == '__main__':
    main()
