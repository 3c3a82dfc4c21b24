#!/usr/bin/env python3
"""Twenty targets at 1280x720: our trackers beside OpenCV's CSRT and KCF, by turns, on the same frames and boxes.

usage (from the repository): cargo xtask peers crowd [--trackers pursuit,kcf] [--frames 20] [--rounds 3] [--threads 2]
needs, from PyPI: numpy, opencv-contrib-python-headless

Frames are the synthetic scene `crowd`, decoded beforehand on both sides; what is timed is the update of all targets. Ours
share the planes derived from a frame (which count) and run on `threads` threads; OpenCV may use as many within each
update. Figures are medians over the rounds: frames a second by the clock on the wall, processor time of all threads for
a frame, and the multiples of the peers' in both. On a machine that has other work to do, the clock on the wall says more
about that work.
"""
import argparse, csv, os, subprocess, tempfile
from timing import cv2, np, opencv, ours, overlap, time, update, whole


def peer(name, images, truth):
    trackers = [opencv(name) for _ in truth[0]]
    for tracker, box in zip(trackers, truth[0]):
        tracker.init(images[0], whole(box))
    seconds, processor, overlaps = 0.0, 0.0, []
    for image, boxes in zip(images[1:], truth[1:]):
        began, before = time.perf_counter(), time.process_time()
        said = [update(t, image) for t in trackers]
        seconds, processor = seconds + time.perf_counter() - began, processor + time.process_time() - before
        overlaps += [overlap(b, t) if seen else 0.0 for (seen, b), t in zip(said, boxes)]
    overlaps = np.array(overlaps)
    return dict(frames=len(images) - 1, seconds=seconds, processor_seconds=processor, mean_overlap=overlaps.mean(), success50=(overlaps > .5).mean())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--trackers', default='pursuit')
    parser.add_argument('--peers', default='csrt,kcf')
    parser.add_argument('--frames', type=int, default=20)
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--threads', type=int, default=2)
    parser.add_argument('--folder', help='where to keep the frames [default: a temporary folder]')
    a = parser.parse_args()
    cv2.setNumThreads(a.threads)
    with tempfile.TemporaryDirectory() as temporary:
        folder = a.folder or temporary
        if not os.path.exists(os.path.join(folder, 'boxes.csv')):
            subprocess.run([os.environ['PURSUIT'], 'write', folder, str(a.frames)], check=True)
        truth = {}
        for row in csv.DictReader(open(os.path.join(folder, 'boxes.csv'))):
            truth.setdefault(int(row['frame']), []).append([float(row[k]) for k in 'xywh'])
        truth = np.array([truth[i] for i in sorted(truth)])[:a.frames]
        images = [cv2.imread(os.path.join(folder, 'images', f'{i:06}.png')) for i in range(len(truth))]
        runs = {}
        for _ in range(a.rounds):
            for name in a.trackers.split(','):
                runs.setdefault(name, []).append(ours('run', folder, name, str(a.threads)))
            for name in a.peers.split(','):
                runs.setdefault(f'OpenCV {name.upper()}', []).append(peer(name, images, truth))
    height, width = images[0].shape[:2]
    print(f'{len(truth[0])} targets, {width}x{height}, {len(truth) - 1} frames, {a.rounds} rounds, {a.threads} threads')
    median = lambda rs, key: float(np.median([r['frames'] / r[key] for r in rs]))
    wall = {n: median(rs, 'seconds') for n, rs in runs.items()}
    processor = {n: median(rs, 'processor_seconds') for n, rs in runs.items()}
    peers = [n for n in wall if n.startswith('OpenCV ')]
    heads = [f'x {p[7:]}' for p in peers] + [f'x {p[7:]} cpu' for p in peers]
    print(f'{"tracker":14s} {"frames/s":>9s} {"cpu ms":>8s} {"overlap":>8s} {"SR50":>6s}' + ''.join(f'{h:>11s}' for h in heads))
    for name, rs in runs.items():
        ratios = [wall[name] / wall[p] for p in peers] + [processor[name] / processor[p] for p in peers]
        print(f'{name:14s} {wall[name]:9.2f} {1e3 / processor[name]:8.1f} {rs[0]["mean_overlap"]:8.3f} '
              f'{rs[0]["success50"]:6.3f}' + ''.join(f'{r:11.2f}' for r in ratios))


if __name__ == '__main__':
    main()
