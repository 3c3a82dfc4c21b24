#!/usr/bin/env python3
"""`pursuit mavlink --gimbal` turns a gimbal that is simulated here, behind pymavlink: the loop is closed by pictures.

usage (from the repository): cargo xtask peers drones; needs, from PyPI: numpy, pymavlink

The gimbal speaks the gimbal protocol v2 as its own manager: it obeys after 200 ms, turns at 60 deg/s at most, and says 20 times a second how it
is turned. The camera on it (60 deg wide) shows somebody who walks as in `pursuit ptz simulate`, before a ground with a texture. Judged: how
often the middle of the target is in the central fifth of the picture. Once the gimbal turns with a vehicle that swings, and once it is a head of
`pursuit ptz follow`, with no ground station.
"""
import math, os, subprocess, sys, tempfile, threading, time
os.environ['MAVLINK20'] = '1'
import numpy as np
from pymavlink import mavutil
from mavlink import ACCEPTED, Station, free_port

m = mavutil.mavlink
SIZE, FPS, WIDE = (320, 180), 25, 60.0
PER_DEG = SIZE[0] / WIDE
DELAY, MOST_RATE, MOST_ACCELERATION = 0.2, 60.0, 120.0
# A picture that waits longer for the program or the machine is a stall.
STALL_S = 0.15
CAMERA_M, HEIGHT_M, WIDTH_M = 2.5, 1.7, 0.5


class Walk:
    """Somebody 5 m away: stands for two seconds, then walks as in `pursuit ptz simulate`, at 1.5 m/s, gaining and losing speed by 2 m/s²."""

    PACE, ACCELERATION, REACH_M, STEP_S = 1.5, 2.0, 4.0, 0.01

    def __init__(self, name, seconds):
        rng = np.random.default_rng(11)
        x, speed, wanted, until = 0.0, 0.0, 0.0, 2.0
        if name == 'standing':
            x = 5 * math.tan(math.radians(8))
        self.times, self.xs = np.arange(0, seconds + 10, self.STEP_S), []
        for t in self.times:
            if t >= until and name == 'passing':
                wanted = self.PACE
            elif t >= until and name == 'pacing':
                stands = wanted != 0 and rng.random() < 0.3
                way = -1.0 if x > self.REACH_M - 2 else 1.0 if x < 2 - self.REACH_M else rng.choice([-1.0, 1.0])
                wanted, until = (0.0 if stands else way * self.PACE), t + rng.uniform(0.8, 3.0)
            # It turns in time, whatever it wanted.
            if name == 'pacing' and abs(x) > self.REACH_M - 0.6 and x * wanted > 0:
                wanted = -wanted
            change = self.ACCELERATION * self.STEP_S
            speed += max(-change, min(change, wanted - speed))
            x += speed * self.STEP_S
            self.xs.append(x)

    def at(self, t):
        """Direction to the right and upward, and the angles of width and height, degrees."""
        x = np.interp(t, self.times, self.xs)
        far = math.hypot(x, 5)
        up = HEIGHT_M / 2 - CAMERA_M
        distance = math.hypot(far, up)
        angle = lambda metres: math.degrees(metres / distance)
        return math.degrees(math.atan2(x, 5)), math.degrees(math.atan2(up, far)), angle(WIDTH_M), angle(HEIGHT_M)


class Gimbal:
    """Turns by rates, late; against the earth, or with a vehicle that swings."""

    def __init__(self, port, start, swings):
        self.swings = swings
        self.angles, self.rates, self.wanted = list(start), [0.0, 0.0], [0.0, 0.0]
        self.orders, self.lock, self.last = [], threading.Lock(), time.monotonic()
        self.began, self.controlled_by, self.over = time.monotonic(), (0, 0), False
        self.link = mavutil.mavlink_connection(f'udpout:127.0.0.1:{port}', source_system=1, source_component=154)
        self.pilot = mavutil.mavlink_connection(f'udpout:127.0.0.1:{port}', source_system=1, source_component=1)
        for work in (self.listen, self.speak):
            threading.Thread(target=work, daemon=True).start()

    def vehicle(self, t):
        """Yaw of the vehicle and its rate, degrees."""
        w = 0.8
        return (12 * math.sin(w * t), 12 * w * math.cos(w * t)) if self.swings else (0.0, 0.0)

    def advance(self, now):
        with self.lock:
            while self.last < now:
                step = min(now - self.last, 0.005)
                self.last += step
                while self.orders and self.orders[0][0] <= self.last:
                    self.wanted = self.orders.pop(0)[1]
                for k in range(2):
                    goal = max(-MOST_RATE, min(MOST_RATE, self.wanted[k]))
                    change = max(-MOST_ACCELERATION * step, min(MOST_ACCELERATION * step, goal - self.rates[k]))
                    self.rates[k] += change
                    self.angles[k] += self.rates[k] * step
                self.angles[1] = max(-90.0, min(30.0, self.angles[1]))

    def looks(self, now):
        """Where the camera looks in the world."""
        self.advance(now)
        yaw, _ = self.vehicle(now - self.began)
        return (self.angles[0] + yaw if self.swings else self.angles[0]), self.angles[1]

    def listen(self):
        while not self.over:
            message = self.link.recv_match(blocking=True, timeout=0.2)
            if message is None:
                continue
            kind, now = message.get_type(), time.monotonic()
            if kind == 'COMMAND_LONG' and message.target_component in (0, 154):
                self.answer(message)
            elif kind == 'GIMBAL_MANAGER_SET_PITCHYAW' and message.target_component == 154:
                if not math.isnan(message.pitch_rate) and not math.isnan(message.yaw_rate):
                    rates = [math.degrees(message.yaw_rate), math.degrees(message.pitch_rate)]
                    with self.lock:
                        self.orders.append((now + DELAY, rates))

    def answer(self, command):
        ack = lambda: self.link.mav.command_ack_send(command.command, ACCEPTED, 0, 0, command.get_srcSystem(), command.get_srcComponent())
        if command.command == m.MAV_CMD_REQUEST_MESSAGE and int(command.param1) == 280:
            axes = m.GIMBAL_MANAGER_CAP_FLAGS_HAS_PITCH_AXIS | m.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_AXIS
            lock = 0 if self.swings else m.GIMBAL_MANAGER_CAP_FLAGS_HAS_YAW_LOCK
            ack()
            limits = [math.radians(v) for v in (-90, 30, -170, 170)]
            self.link.mav.gimbal_manager_information_send(0, axes | lock, 154, 0, 0, *limits)
        elif command.command == m.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE:
            self.controlled_by = (0, 0) if command.param1 == -3 else (int(command.param1), int(command.param2))
            ack()
        elif command.command == m.MAV_CMD_SET_MESSAGE_INTERVAL:
            ack()

    def speak(self):
        while not self.over:
            now = time.monotonic()
            self.advance(now)
            yaw, pitch = (math.radians(v) / 2 for v in self.angles)
            q = [math.cos(pitch) * math.cos(yaw), -math.sin(pitch) * math.sin(yaw), math.sin(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw)]
            flags = m.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME if self.swings else m.GIMBAL_DEVICE_FLAGS_YAW_LOCK
            rates = [0, math.radians(self.rates[1]), math.radians(self.rates[0])]
            self.link.mav.gimbal_device_attitude_status_send(0, 0, 0, flags, q, *rates, 0)
            self.link.mav.gimbal_manager_status_send(0, flags, 154, *self.controlled_by, 0, 0)
            vehicle, rate = self.vehicle(now - self.began)
            self.pilot.mav.attitude_send(0, 0, 0, math.radians(vehicle), 0, 0, math.radians(rate))
            self.link.mav.heartbeat_send(m.MAV_TYPE_GIMBAL, m.MAV_AUTOPILOT_INVALID, 0, 0, 4)
            time.sleep(0.05)


def textures():
    rng = np.random.default_rng(3)
    def smooth(height, width, n):
        noise = rng.random((height, width))
        return np.mean([np.roll(noise, (dy, dx), (0, 1)) for dy in range(n) for dx in range(n)], axis=0)
    ground = 100 + (smooth(int(120 * PER_DEG), int(360 * PER_DEG), 9) - 0.5) * 700
    person = 140 + (smooth(200, 60, 5) - 0.5) * 500
    return np.clip(ground, 20, 200), np.clip(person, 60, 240)


def picture(ground, person, looks, target):
    (yaw, pitch), (right, up, wide, high) = looks, target
    top = round((60 - pitch - SIZE[1] / 2 / PER_DEG) * PER_DEG)
    left = round((180 + yaw - WIDE / 2) * PER_DEG)
    rows = np.clip(np.arange(top, top + SIZE[1]), 0, ground.shape[0] - 1)
    columns = np.arange(left, left + SIZE[0]) % ground.shape[1]
    luma = ground[np.ix_(rows, columns)].copy()
    x, y = SIZE[0] / 2 + (right - yaw) * PER_DEG, SIZE[1] / 2 - (up - pitch) * PER_DEG
    w, h = wide * PER_DEG, high * PER_DEG
    x0, x1, y0, y1 = (round(v) for v in (x - w / 2, x + w / 2, y - h / 2, y + h / 2))
    a, b, c, d = max(x0, 0), min(x1, SIZE[0]), max(y0, 0), min(y1, SIZE[1])
    chroma = [np.full((SIZE[1], SIZE[0]), 128.0), np.full((SIZE[1], SIZE[0]), 128.0)]
    if a < b and c < d:
        u = ((np.arange(a, b) - x0) * person.shape[1] // max(x1 - x0, 1)).clip(0, person.shape[1] - 1)
        v = ((np.arange(c, d) - y0) * person.shape[0] // max(y1 - y0, 1)).clip(0, person.shape[0] - 1)
        luma[c:d, a:b] = person[np.ix_(v, u)]
        chroma[0][c:d, a:b], chroma[1][c:d, a:b] = 105, 165
    planes = [luma, *(plane[::2, ::2] for plane in chroma)]
    return b'FRAME\n' + b''.join(np.clip(p, 0, 255).astype(np.uint8).tobytes() for p in planes), (x, y, w, h)


def one(name, seconds, swings=False, head=False):
    port, walk = free_port(), Walk(name, seconds)
    ground, person = textures()
    first = walk.at(0)
    gimbal = Gimbal(port, (0.0, first[1]), swings)
    link = f'udpin:127.0.0.1:{port}'
    if head:
        # The target stands until the gimbal is taken: its box in the first picture is known.
        _, (x, y, w, h) = picture(ground, person, (0.0, first[1]), first)
        subcommand = ['ptz', 'follow', '-', '--head', f'mavlink:{link}', '--field-of-view', str(WIDE), '--box', f'{x - w / 2},{y - h / 2},{w},{h}']
    else:
        subcommand = ['mavlink', '-', '--link', link, '--gimbal', '--camera-view', str(WIDE)]
    settings = ['--set', f'follower.command_delay_s={DELAY}', '--fps', str(FPS), '--out', tempfile.mkdtemp(), '-v']
    command = [os.environ['PURSUIT'], *subcommand, *settings]
    program = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    station = None if head else Station(f'udpout:127.0.0.1:{port}')
    program.stdin.write(f'YUV4MPEG2 W{SIZE[0]} H{SIZE[1]} F{FPS}:1 Ip A1:1 C420jpeg\n'.encode())
    offsets, began, k, asked, written, gap = [], None, 0, False, None, 0.0
    while began is None or (time.monotonic() - began) < seconds:
        now = time.monotonic()
        t = 0.0 if began is None else now - began
        looks = gimbal.looks(now)
        frame, (x, y, w, h) = picture(ground, person, looks, walk.at(t))
        try:
            program.stdin.write(frame), program.stdin.flush()
        except BrokenPipeError:
            break
        if written is not None:
            gap = max(gap, now - written)
        k, written = k + 1, now
        if began is None and gimbal.controlled_by == (1, 100) and not asked:
            asked = True
            if head:
                began = time.monotonic()
                continue
            def start(box=((x - w / 2) / SIZE[0], (y - h / 2) / SIZE[1], (x + w / 2) / SIZE[0], (y + h / 2) / SIZE[1])):
                nonlocal began
                box = [min(max(v, 0), 1) for v in box]
                result, _ = station.command(m.MAV_CMD_CAMERA_TRACK_RECTANGLE, *box)
                assert result == ACCEPTED, result
                began = time.monotonic()
            threading.Thread(target=start, daemon=True).start()
        if began is not None and t >= 3:
            offsets.append(((x - SIZE[0] / 2) / SIZE[0], (y - SIZE[1] / 2) / SIZE[1]))
        assert began is not None or k < 30 * FPS, 'the gimbal was not taken'
        time.sleep(max(0.0, 1 / FPS - (time.monotonic() - now)))
    program.stdin.close()
    log = program.stderr.read().decode()
    said = program.stdout.read().decode()
    assert program.wait(timeout=30) == 0, log[-2000:]
    given_back = gimbal.controlled_by == (0, 0)
    gimbal.over = True
    if station:
        station.close()
    central = np.mean([abs(x) <= 0.1 and abs(y) <= 0.1 for x, y in offsets])
    shown = np.mean([abs(x) <= 0.5 and abs(y) <= 0.5 for x, y in offsets])
    states = next(line for line in said.splitlines() if line.startswith('states'))
    print(f'{name:<9} {"with a vehicle that swings" if swings else "as a head" if head else "":<26} central {100 * central:5.1f} %, in the picture {100 * shown:5.1f} %; longest gap {gap:.2f} s; {states}', flush=True)
    assert given_back, 'control is given back'
    return central, gap


def held(name, seconds, bar, tries=4, **manner):
    """One walk; again where pictures came too late to be followed: the gimbal, the world and the program share a machine that may be busy."""
    for _ in range(tries):
        central, gap = one(name, seconds, **manner)
        if central >= bar:
            return
        assert gap > STALL_S, f'{name} {manner}: the middle of the target was in the central fifth of {100 * central:.1f} % of pictures'
    print(f'skipped: {name} {manner}: the machine was never in time', flush=True)


def main():
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 25.0
    for name in ('pacing', 'passing', 'standing'):
        held(name, seconds, 0.95)
    held('pacing', seconds, 0.95, head=True)
    held('pacing', seconds, 0.9, swings=True)
    print('the gimbal keeps its target in the middle')


if __name__ == '__main__':
    sys.exit(main())
