#!/usr/bin/env python3
"""Recordings of robots: bags that rosbags writes are followed as the clip is, and what we write is read by others.

usage (from the repository): cargo xtask peers bags; needs, from PyPI: mcap-ros2-support, numpy, opencv-python-headless, rosbags

A clip is made here as a folder of images, and written by rosbags as ROS 2 bags (MCAP and SQLite, raw and PNG, compressed and not). The
trajectory of each is that of the folder, line for line. A bag that is cut off anywhere gives the lines that can be read, and exit status
3. The detections that we write are read by mcap-ros2-support; the conversions of the ROS 2 node are held to messages of
rosbags.
"""
import csv, importlib.util, json, os, subprocess, sys, tempfile
from pathlib import Path
import cv2
import numpy as np
from mcap_ros2.decoder import DecoderFactory
from mcap.reader import make_reader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

SIZE, COUNT, FPS, PATCH = (200, 150), 60, 25, 30
TYPES = get_typestore(Stores.ROS2_HUMBLE)


def pictures():
    rng = np.random.default_rng(2)
    ground = cv2.GaussianBlur(rng.integers(0, 255, (SIZE[1], SIZE[0], 3), np.uint8), (0, 0), 3)
    patch = cv2.GaussianBlur(rng.integers(0, 255, (PATCH, PATCH, 3), np.uint8), (0, 0), 1.5)
    for k in range(COUNT):
        picture = ground.copy()
        x, y = 30 + 2 * k, 50 + round(15 * np.sin(k / 8))
        if not 40 <= k < 46:
            picture[y:y + PATCH, x:x + PATCH] = patch[:, :max(0, min(PATCH, SIZE[0] - x))]
        yield picture


def header(k):
    time = TYPES.types['builtin_interfaces/msg/Time'](sec=1000 + k // FPS, nanosec=k % FPS * (1_000_000_000 // FPS))
    return TYPES.types['std_msgs/msg/Header'](stamp=time, frame_id='camera')


def raw(k, picture):
    data = picture.reshape(-1)
    return TYPES.types['sensor_msgs/msg/Image'](header=header(k), height=SIZE[1], width=SIZE[0], encoding='bgr8', is_bigendian=0, step=3 * SIZE[0], data=data)


def compressed(k, picture):
    data = cv2.imencode('.png', picture)[1].reshape(-1)
    return TYPES.types['sensor_msgs/msg/CompressedImage'](header=header(k), format='png', data=data)


def bag(folder, message, images, storage=StoragePlugin.MCAP, compression=None):
    writer = Writer(folder, version=9, storage_plugin=storage)
    if compression:
        writer.set_compression(CompressionMode.STORAGE, compression)
    with writer:
        kind = type(message(0, images[0])).__msgtype__
        topic = writer.add_connection('/camera/image', kind, typestore=TYPES)
        for k, picture in enumerate(images):
            writer.write(topic, int((1000 + k / FPS) * 1e9), TYPES.serialize_cdr(message(k, picture), kind))


def follow(source, out, status=0, *more):
    command = [os.environ['PURSUIT'], 'track', source, '--box', f'30,50,{PATCH},{PATCH}', '--out', out, '--no-video', *more]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == status, (done.returncode, done.stderr)
    with open(Path(out) / 'trajectory.csv') as file:
        # How long an update took is no part of the trajectory.
        rows = [{k: v for k, v in row.items() if k != 'update_ms'} for row in csv.DictReader(file)]
    return rows, done.stderr


def read_by_others(path, rows):
    with open(path, 'rb') as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        arrays = [m for _, channel, _, m in reader.iter_decoded_messages(topics=['/pursuit/detections'])]
        file.seek(0)
        states = [json.loads(m.data) for _, channel, m in make_reader(file).iter_messages(topics=['/pursuit/states'])]
    assert len(arrays) == len(states) == len(rows)
    for array, state, row in zip(arrays, states, rows):
        assert state['targets'][0]['state'] == row['state']
        if row['state'] == 'lost':
            assert not array.detections
            continue
        (found,) = array.detections
        assert found.id == row['target'] and found.results[0].hypothesis.class_id == 'target'
        center = (found.bbox.center.position.x, found.bbox.center.position.y)
        box = [float(row[k]) for k in 'xywh']
        expected = (box[0] + box[2] / 2, box[1] + box[3] / 2, box[2], box[3])
        assert np.allclose([*center, found.bbox.size_x, found.bbox.size_y], expected, atol=2e-3), (row, found)
        at = array.header.stamp.sec + 1e-9 * array.header.stamp.nanosec
        assert abs(at - float(row['time_s'])) < 1e-6


def node(images):
    spec = importlib.util.spec_from_file_location('node', Path(__file__).parents[2] / 'examples/ros2/pursuit_node.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for message in (raw, compressed):
        assert np.array_equal(module.image_to_array(message(3, images[3])), images[3][:, :, ::-1])
    assert abs(module.time_s(header(30)) - 1001.2) < 1e-6


def main():
    images = list(pictures())
    with tempfile.TemporaryDirectory() as folder:
        at = lambda name: os.path.join(folder, name)
        os.mkdir(at('clip'))
        for k, picture in enumerate(images):
            cv2.imwrite(at(f'clip/{k:04}.png'), picture)
        expected, _ = follow(at('clip'), at('of-clip'), 0, '--fps', str(FPS))
        zstd, sqlite = CompressionFormat.ZSTD, StoragePlugin.SQLITE3
        bags = {'raw': (raw,), 'png': (compressed,), 'zstd': (raw, StoragePlugin.MCAP, zstd), 'database': (raw, sqlite), 'png-database': (compressed, sqlite)}
        cut_after = {}
        for name, (message, *how) in bags.items():
            bag(at(name), message, images, *how)
            (file,) = [f for f in Path(at(name)).iterdir() if f.suffix in ('.mcap', '.db3')]
            for source in (at(name), f'{file}?topic=/camera/image'):
                rows, _ = follow(source, at('out'), 0, '--overwrite', '--format', 'mcap')
                assert rows == expected, (name, [(a, b) for a, b in zip(expected, rows) if a != b][:2])
            read_by_others(at('out/trajectory.mcap'), rows)
            whole = file.read_bytes()
            for share in (0.3, 0.5, 0.9):
                cut = Path(at(f'cut{file.suffix}'))
                cut.write_bytes(whole[:int(len(whole) * share)])
                rows, said = follow(str(cut), at('cut'), 3, '--overwrite')
                assert 2 < len(rows) < COUNT and 'cut off' in said, (name, share, len(rows), said)
                assert rows == expected[:len(rows)]
                cut_after[f'{name} {share}'] = len(rows)
    node(images)
    print(f'bags: {COUNT} frames of {len(bags)} bags followed as the clip is, cut ones as far as they go ({cut_after}); what we write is read by others')


if __name__ == '__main__':
    sys.exit(main())
