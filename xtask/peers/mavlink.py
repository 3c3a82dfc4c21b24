#!/usr/bin/env python3
"""`pursuit mavlink` as ground stations see it: pymavlink and MAVSDK, which we did not write, ask, start, lose, find again and stop.

usage (from the repository): cargo xtask peers drones; needs, from PyPI: mavsdk, numpy, pymavlink

A clip made here shows a patch that stands, walks out of the picture, comes back and stands: where it is, is known at every moment. Asked
as QGroundControl asks (camera information, settings, streams, intervals), by rectangle and by point, from two ground stations; with
senseless commands, commands for others, a million random bytes, wrong checksums, a link cut for ten seconds (UDP and TCP), and signed.
"""
import math, os, random, signal, socket, subprocess, sys, tempfile, threading, time
os.environ['MAVLINK20'] = '1'
import numpy as np
from pymavlink import mavutil

FPS, SIZE, PATCH = 25, (320, 240), (36, 44)
SECONDS = 52.0
STANDS, LEAVES, BACK = (90.0, 110.0), 8.0, 20.0
ACTIVE, ERROR, COASTING = 1, 2, 8
ACCEPTED, REJECTED, DENIED, UNSUPPORTED = 0, 1, 2, 3
m = mavutil.mavlink


def center(t):
    """Where the middle of the patch is; it walks to the right and back."""
    x, y = STANDS
    if LEAVES <= t < BACK:
        middle = (LEAVES + BACK) / 2
        away = (t - LEAVES if t < middle else BACK - t) * 110.0
        return x + away, y
    return x, y


def is_gone(t):
    return center(t)[0] - PATCH[0] / 2 >= SIZE[0]


def clip(path):
    rng = np.random.default_rng(5)
    blur = lambda image, n: np.mean([np.roll(image, (dy, dx), (0, 1)) for dy in range(n) for dx in range(n)], axis=0)
    ground = 90 + 60 * (blur(rng.random((SIZE[1], SIZE[0])), 5) - 0.5) * 4
    patch = 150 + 150 * (blur(rng.random((PATCH[1], PATCH[0])), 3) - 0.5) * 2
    with open(path, 'wb') as file:
        file.write(f'YUV4MPEG2 W{SIZE[0]} H{SIZE[1]} F{FPS}:1 Ip A1:1 C420jpeg\n'.encode())
        for k in range(int(SECONDS * FPS)):
            t = k / FPS
            luma = ground + rng.normal(0, 2, ground.shape)
            cb, cr = np.full(ground.shape, 128.0), np.full(ground.shape, 128.0)
            left, top = (round(c - s / 2) for c, s in zip(center(t), PATCH))
            right = min(left + PATCH[0], SIZE[0])
            if left < right:
                luma[top:top + PATCH[1], left:right] = patch[:, :right - left]
                cr[top:top + PATCH[1], left:right] = 190
                cb[top:top + PATCH[1], left:right] = 100
            file.write(b'FRAME\n' + b''.join(np.clip(p, 0, 255).astype(np.uint8).tobytes() for p in (luma, cb[::2, ::2], cr[::2, ::2])))


def free_port(kind=socket.SOCK_DGRAM):
    with socket.socket(socket.AF_INET, kind) as s:
        s.bind(('127.0.0.1', 0))
        return s.getsockname()[1]


class Program:
    """`pursuit mavlink` on the clip; its clock begins when it says that the link is open."""

    def __init__(self, video, links, *more):
        self.out = tempfile.mkdtemp()
        links = [part for link in links for part in ('--link', link)]
        command = [os.environ['PURSUIT'], 'mavlink', video, *links, '--real-time', '--out', self.out, '-v', *more]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.log, self.began = [], time.monotonic()
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stderr:
            if 'pixels, read by' in line:
                self.began = time.monotonic()
            self.log.append(line.rstrip())

    def now(self):
        return time.monotonic() - self.began

    def end(self):
        self.process.send_signal(signal.SIGINT)
        out, _ = self.process.communicate(timeout=30)
        assert self.process.returncode == 130, (self.process.returncode, self.log[-5:])
        assert not any('panicked' in line for line in self.log), self.log
        return out


class Station:
    """A ground station: says that it is there, asks, and keeps all that it hears, with the time."""

    def __init__(self, address, system=255, key=None, component=190):
        self.address, self.system, self.component, self.key = address, system, component, key
        self.heard, self.lock, self.open_now = [], threading.Lock(), False
        self.open()

    def open(self):
        self.link = mavutil.mavlink_connection(self.address, source_system=self.system, source_component=self.component)
        if self.key:
            self.link.setup_signing(self.key, sign_outgoing=True)
        self.open_now = True
        threading.Thread(target=self.listen, args=(self.link,), daemon=True).start()
        threading.Thread(target=self.beat, args=(self.link,), daemon=True).start()

    def close(self):
        self.open_now = False
        time.sleep(0.3)
        self.link.close()

    def beat(self, link):
        while self.open_now and self.link is link:
            link.mav.heartbeat_send(m.MAV_TYPE_GCS, m.MAV_AUTOPILOT_INVALID, 0, 0, 0)
            time.sleep(0.5)

    def listen(self, link):
        while self.open_now and self.link is link:
            try:
                message = link.recv_match(blocking=True, timeout=0.2)
            except OSError:
                continue
            if message is not None and message.get_type() != 'BAD_DATA':
                with self.lock:
                    self.heard.append((time.monotonic(), message))

    def since(self, begin, kind):
        with self.lock:
            return [(at, message) for at, message in self.heard if at >= begin and message.get_type() == kind]

    def wait(self, kind, fits=lambda message: True, begin=None, seconds=6):
        begin = time.monotonic() if begin is None else begin
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            for _, message in self.since(begin, kind):
                if fits(message):
                    return message
            time.sleep(0.01)

    def command(self, number, *params, to=(1, 100), seconds=4, confirmation=0):
        """Sends it once and gives back the answer's result, and the answer."""
        params = (*params, *[0.0] * (7 - len(params)))
        begin = time.monotonic()
        self.link.mav.command_long_send(*to, number, confirmation, *params)
        mine = lambda ack: ack.command == number and ack.target_system in (0, self.system)
        ack = self.wait('COMMAND_ACK', mine, begin, seconds)
        return (None if ack is None else ack.result), ack

    def asked(self, number, *params):
        """The message that a request brings, which has to be granted."""
        begin = time.monotonic()
        result, _ = self.command(m.MAV_CMD_REQUEST_MESSAGE, number, *params)
        assert result == ACCEPTED, (number, result)
        name = m.mavlink_map[number].msgname
        message = self.wait(name, begin=begin)
        assert message is not None, name
        return message


def rectangle(t):
    (x, y), (w, h) = center(t), PATCH
    return [(x - w / 2) / SIZE[0], (y - h / 2) / SIZE[1], (x + w / 2) / SIZE[0], (y + h / 2) / SIZE[1]]


def overlap(a, b):
    wide, high = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    both = max(wide, 0) * max(high, 0)
    area = lambda r: (r[2] - r[0]) * (r[3] - r[1])
    return both / (area(a) + area(b) - both)


def place(status):
    return [status.rec_top_x, status.rec_top_y, status.rec_bottom_x, status.rec_bottom_y]


def is_unknown(status):
    return all(math.isnan(v) for v in (*place(status), status.point_x, status.point_y, status.radius))


def check_information(station):
    information = station.asked(259)
    flags = m.CAMERA_CAP_FLAGS_HAS_TRACKING_POINT | m.CAMERA_CAP_FLAGS_HAS_TRACKING_RECTANGLE
    assert information.flags & flags == flags, information.flags
    assert (information.resolution_h, information.resolution_v) == SIZE and math.isnan(information.focal_length)
    assert bytes(information.vendor_name).rstrip(b'\0') == b'pursuit'
    for number in (260, 261, 262, 271, 275):
        station.asked(number)
    for number in (m.MAV_CMD_REQUEST_CAMERA_INFORMATION, 522, 525, 527):
        assert station.command(number, 1)[0] == ACCEPTED, number
    assert station.command(m.MAV_CMD_REQUEST_MESSAGE, 269)[0] == UNSUPPORTED, 'there is no stream'
    assert station.command(m.MAV_CMD_REQUEST_MESSAGE, 33)[0] == UNSUPPORTED
    assert station.command(31_000)[0] == UNSUPPORTED, 'a command that nobody knows'
    assert station.command(m.MAV_CMD_IMAGE_START_CAPTURE, 0, 0, 1)[0] == UNSUPPORTED
    assert station.command(m.MAV_CMD_GET_MESSAGE_INTERVAL, 275)[0] == ACCEPTED


def check_rates(station):
    for interval_us, expected in ((100_000, 10), (500_000, 2)):
        assert station.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, 275, interval_us)[0] == ACCEPTED
        begin = time.monotonic()
        time.sleep(2)
        count = len(station.since(begin, 'CAMERA_TRACKING_IMAGE_STATUS')) / 2
        assert 0.7 * expected <= count <= 1.3 * expected + 1, (interval_us, count)
    assert station.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, 275, -1)[0] == ACCEPTED
    begin = time.monotonic()
    time.sleep(1)
    assert not station.since(begin + 0.1, 'CAMERA_TRACKING_IMAGE_STATUS'), 'who wants nothing gets nothing'
    assert station.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, 275, 40_000)[0] == ACCEPTED
    assert station.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, 24, 40_000)[0] == UNSUPPORTED


def check_senseless(station):
    nan, track = math.nan, m.MAV_CMD_CAMERA_TRACK_RECTANGLE
    for params in ((nan, 0, 1, 1), (0, 0, 2, 1), (0.5, 0.5, 0.5, 0.6), (-0.1, 0, 1, 1)):
        assert station.command(track, *params)[0] == DENIED, params
    assert station.command(m.MAV_CMD_CAMERA_TRACK_POINT, 1.5, 0.5)[0] == DENIED
    assert station.command(m.MAV_CMD_CAMERA_TRACK_POINT, 0.5, 0.5, 0, 101)[0] == DENIED, 'another camera'
    for others in ((2, 100), (1, 101)):
        assert station.command(track, 0.1, 0.1, 0.2, 0.2, to=others, seconds=0.7)[0] is None, others


def check_following(program, station):
    """Started by a rectangle: seen, hidden or lost while it is away, and seen again; never at an old place as if it were seen."""
    assert program.now() < LEAVES - 1.5, f'too slow: {program.now():.1f} s'
    result, _ = station.command(m.MAV_CMD_CAMERA_TRACK_RECTANGLE, *rectangle(program.now()))
    assert result == ACCEPTED, result
    begin = time.monotonic()
    while program.now() < BACK + 4:
        time.sleep(0.1)
    lies, seen, away = 0, [], []
    for at, status in station.since(begin, 'CAMERA_TRACKING_IMAGE_STATUS'):
        t = at - program.began
        if is_gone(t - 0.3) and is_gone(t):
            away.append(status.tracking_status)
            lies += status.tracking_status == ACTIVE
        elif status.tracking_status == ACTIVE:
            seen.append((t, max(overlap(place(status), rectangle(t - late / 25)) for late in range(6))))
        if status.tracking_status & ERROR:
            assert is_unknown(status) and status.tracking_mode == 2 and status.target_data == 0, status
    assert len(seen) > 100 and np.mean([o for _, o in seen]) > 0.6, (len(seen), np.mean([o for _, o in seen]))
    assert len(away) > 30 and ERROR in away, set(away)
    assert lies <= 0.1 * len(away), f'{lies} of {len(away)} told as seen while nothing was there'
    # From when the whole of it can be seen again.
    whole = next(t for t in np.arange((LEAVES + BACK) / 2, BACK, 0.01) if center(t)[0] + PATCH[0] / 2 <= SIZE[0])
    back = [t - whole for t, o in seen if t > (LEAVES + BACK) / 2 and o > 0.5]
    assert back and back[0] < 3, 'never found again'
    return len(seen), len(away), lies, back[0]


def check_point(program, station, other):
    (x, y), begin = center(program.now()), time.monotonic()
    result, ack = other.command(m.MAV_CMD_CAMERA_TRACK_POINT, x / SIZE[0], y / SIZE[1], 0.05)
    assert result == ACCEPTED and ack.result_param2 in (1, 2, 3), (result, ack)
    by_point = lambda status: status.tracking_mode == 1 and status.tracking_status == ACTIVE
    for each in (station, other):
        status = each.wait('CAMERA_TRACKING_IMAGE_STATUS', by_point, begin)
        assert status is not None, 'both ground stations are told'
        assert abs(status.point_x - x / SIZE[0]) < 0.05 and abs(status.point_y - y / SIZE[1]) < 0.07, status
        assert overlap(place(status), rectangle(program.now())) > 0.4, status
    # The same once more, because the answer got lost: it is answered, not done again.
    again, _ = other.command(m.MAV_CMD_CAMERA_TRACK_POINT, x / SIZE[0], y / SIZE[1], 0.05, confirmation=1)
    assert again == ACCEPTED
    return ack.result_param2


def check_stop(station):
    begin = time.monotonic()
    assert station.command(m.MAV_CMD_CAMERA_STOP_TRACKING)[0] == ACCEPTED
    idle = station.wait('CAMERA_TRACKING_IMAGE_STATUS', lambda s: s.tracking_status == 0, begin)
    assert idle is not None and is_unknown(idle) and idle.tracking_mode == 0


def rubbish(port, station):
    """A million random bytes, and commands with wrong checksums: nothing comes of them."""
    rng = random.Random(3)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
        for _ in range(1000):
            s.sendto(rng.randbytes(1000), ('127.0.0.1', port))
        mav = m.MAVLink(None, srcSystem=250, srcComponent=1)
        for k in range(500):
            params = (0.1, 0.1, 0.3, 0.3, 0, 0, 0)
            message = m.MAVLink_command_long_message(1, 100, m.MAV_CMD_CAMERA_TRACK_RECTANGLE, 0, *params)
            bytes_ = bytearray(message.pack(mav))
            bytes_[-1 - k % 2] ^= 1 << k % 8
            s.sendto(bytes(bytes_), ('127.0.0.1', port))
    status = station.asked(275)
    assert status.tracking_status == 0, 'a wrong checksum has started something'


def over_udp(video):
    port = free_port()
    program = Program(video, [f'udpin:127.0.0.1:{port}'])
    station = Station(f'udpout:127.0.0.1:{port}')
    heartbeat = station.wait('HEARTBEAT', lambda h: h.get_srcComponent() == 100, 0, 20)
    assert heartbeat.type == m.MAV_TYPE_CAMERA and heartbeat.get_srcSystem() == 1
    assert station.command(m.MAV_CMD_SET_MESSAGE_INTERVAL, 275, 40_000)[0] == ACCEPTED
    other = Station(f'udpout:127.0.0.1:{port}', system=254)
    seen, away, lies, back = check_following(program, station)
    print(f'  seen {seen} times, away {away}, of that told as seen {lies}; found again {back:+.1f} s after it was whole in the picture')
    how = check_point(program, station, other)
    print(f'  a point became a box: {["", "it moves", "it stands out", "the radius"][how]}')
    check_stop(other)
    check_information(station)
    check_senseless(station)
    rubbish(port, station)
    program.end()
    program = Program(video, [f'udpin:127.0.0.1:{port}'])
    time.sleep(1.5)
    assert station.command(m.MAV_CMD_CAMERA_TRACK_RECTANGLE, *rectangle(0))[0] == ACCEPTED
    check_rates(station)
    station.close()
    time.sleep(10)
    station.open()
    assert station.wait('CAMERA_TRACKING_IMAGE_STATUS', seconds=10) is not None, 'after ten seconds without a link'
    begin = time.monotonic()
    said = program.end()
    assert 'latency' in said and 'links' in said, said
    last = station.since(begin - 0.5, 'CAMERA_TRACKING_IMAGE_STATUS')[-1][1]
    assert last.tracking_status == 0, 'nobody tracks any more'
    station.close(), other.close()


def over_tcp(video):
    """A server that goes away for ten seconds."""
    port = free_port(socket.SOCK_STREAM)
    program = Program(video, [f'tcp:127.0.0.1:{port}'])
    time.sleep(1)
    for _ in range(2):
        station = Station(f'tcpin:127.0.0.1:{port}')
        assert station.wait('HEARTBEAT', lambda h: h.get_srcComponent() == 100, 0, 20) is not None
        station.asked(259)
        station.close()
        time.sleep(10 if _ == 0 else 0)
    program.end()


def signed(video):
    port, key = free_port(), bytes(range(32))
    with tempfile.NamedTemporaryFile('w', suffix='.key') as file:
        file.write(key.hex())
        file.flush()
        program = Program(video, [f'udpin:127.0.0.1:{port}'], '--signing-key-file', file.name)
        stranger = Station(f'udpout:127.0.0.1:{port}', system=253)
        station = Station(f'udpout:127.0.0.1:{port}', key=key)
        assert station.wait('HEARTBEAT', lambda h: h.get_srcComponent() == 100, 0, 20) is not None
        station.asked(259)
        assert stranger.command(m.MAV_CMD_CAMERA_STOP_TRACKING, seconds=1.5)[0] is None, 'not signed'
        assert station.command(31_000)[0] == UNSUPPORTED
        assert key.hex() not in '\n'.join(program.log)
        program.end()
        station.close(), stranger.close()


def by_mavsdk(video):
    """MAVSDK as a ground station: finds the camera, and starts and stops by its camera plugin."""
    import json
    from mavsdk.component_type import ComponentType
    from mavsdk.mavsdk import Configuration, Mavsdk
    from mavsdk.plugins.camera import Camera
    from mavsdk.plugins.mavlink_direct import MavlinkDirect
    port = free_port()
    station = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    assert station.add_any_connection(f'udpin://127.0.0.1:{port}') == 0
    program = Program(video, [f'udpout:127.0.0.1:{port}'])
    wait_for = lambda what: next((found for _ in range(100) if (found := what()) or time.sleep(0.1)), None)
    system = wait_for(lambda: next(iter(s for s in station.get_systems() if s.has_camera(-1)), None))
    assert system is not None, 'no camera is found'
    camera, direct, heard = Camera(system), MavlinkDirect(system), []
    direct.subscribe_message('CAMERA_TRACKING_IMAGE_STATUS', lambda message, _: heard.append(json.loads(message.fields_json)))
    known = wait_for(lambda: camera.camera_list().cameras)
    assert known and known[0].vendor_name == 'pursuit', known
    which = known[0].component_id
    camera.track_rectangle(which, *rectangle(0))
    assert wait_for(lambda: any(s['tracking_status'] == ACTIVE for s in heard[-5:])), heard[-3:]
    assert overlap([heard[-1][k] for k in ('rec_top_x', 'rec_top_y', 'rec_bottom_x', 'rec_bottom_y')], rectangle(0)) > 0.6
    camera.track_stop(which)
    assert wait_for(lambda: heard[-1]['tracking_status'] == 0)
    camera.track_point(which, STANDS[0] / SIZE[0], STANDS[1] / SIZE[1], 0.05)
    assert wait_for(lambda: heard[-1]['tracking_status'] == ACTIVE and heard[-1]['tracking_mode'] == 1), heard[-1]
    camera.track_stop(which)
    program.end()


def main():
    with tempfile.TemporaryDirectory() as folder:
        video = os.path.join(folder, 'clip.y4m')
        clip(video)
        for check in (over_udp, over_tcp, signed, by_mavsdk):
            print(check.__name__, flush=True)
            check(video)
    print('MAVLink: all as asked')


if __name__ == '__main__':
    sys.exit(main())
