#!/usr/bin/env python3
"""Live sources of servers that we did not write: an RTSP server from PyPI (aio-rtsp-toolkit) and Python's own web server.

usage (from the repository): cargo xtask peers streams; needs, from PyPI: aio-rtsp-toolkit[server], imageio-ffmpeg

WATCH names `watch` (an example of pursuit-media), built with the feature `rtsp`; with the argument `ffmpeg` everything goes
through that. The servers play, freeze (SIGSTOP) and thaw, are killed and started again, are killed for good, come back with
another size, are slow, and send garbage; a door before the RTSP server asks for passwords, and ffmpeg writes a live playlist
that Python's server hands out. What is asked of us: time and numbers go on, the counts are right, what fails ends
with status 3 in bounded time, and no process is left.
"""
import base64, concurrent.futures, contextlib, functools, hashlib, os, re, secrets, shutil, signal, socket, subprocess, sys, tempfile, threading, time, urllib.parse
import imageio_ffmpeg

WATCH, FFMPEG = os.environ['WATCH'], imageio_ffmpeg.get_ffmpeg_exe()
FPS, SECONDS = 25, 30
USER, PASSWORD = 'watch', 's3same/@ :x'


def free_port():
    with socket.socket() as s:
        s.bind(('127.0.0.1', 0))
        return s.getsockname()[1]


def film(path, size, *more):
    subprocess.run([FFMPEG, '-nostdin', '-v', 'error', '-y', '-f', 'lavfi', '-i', f'testsrc2=size={size}:rate={FPS}', '-t', str(SECONDS),
                    '-c:v', 'libx264', '-preset', 'ultrafast', '-pix_fmt', 'yuv420p', '-g', str(FPS), *more, path], check=True)


class Server:
    """A process that listens on a port."""

    def __init__(self, port, *command):
        self.port, self.command = port, command
        self.start()

    def start(self):
        self.process = subprocess.Popen(self.command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for _ in range(300):
            with contextlib.suppress(OSError), socket.create_connection(('127.0.0.1', self.port), 1):
                return self
            time.sleep(0.1)
        raise SystemExit(f'{self.command[0]} does not listen')

    def signal(self, number):
        self.process.send_signal(number)

    def kill(self):
        self.process.kill()
        self.process.wait()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()


def rtsp(folder, port=None):
    port = port or free_port()
    script = os.path.join(os.path.dirname(sys.executable), 'rtsp-server')
    return Server(port, sys.executable, script, '--dir', folder, '--host', '127.0.0.1', '--port', str(port), '--control-port', str(free_port()))


def web(folder):
    port = free_port()
    return Server(port, sys.executable, '-m', 'http.server', '--bind', '127.0.0.1', '--directory', folder, str(port))


class Watch:
    """`watch`, running."""

    def __init__(self, url, seconds, stall=1, reconnect=30):
        words = [WATCH, url, str(seconds), str(stall), str(reconnect), *sys.argv[1:]]
        env = {**os.environ, 'PURSUIT_FFMPEG': FFMPEG}
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env)

    def end(self):
        out, self.errors = self.process.communicate(timeout=120)
        lines = out.splitlines()
        self.status = self.process.returncode
        self.frames = [tuple(float(w) for w in line.split()) for line in lines if not line.startswith('#')]
        self.head = next((line for line in lines if line.startswith('#')), '')
        self.counts = dict(w.split('=') for line in lines[1:] if line.startswith('#') for w in line[2:].split())
        times, numbers = [f[1] for f in self.frames], [f[0] for f in self.frames]
        assert all(a < b for a, b in zip(times, times[1:])), 'time goes back'
        assert numbers == sorted(set(numbers)), 'numbers go back'
        return self

    def __getitem__(self, name):
        return float(self.counts[name])

    def gap(self):
        times = [f[1] for f in self.frames]
        return max((b - a for a, b in zip(times, times[1:])), default=0)


def check(what, true, seen):
    if not true:
        raise AssertionError(f'{what}: {seen}')


def playing(small, _):
    with rtsp(small) as server:
        w = Watch(f'rtsp://127.0.0.1:{server.port}/clip.mp4', 8).end()
    check('plays', w.status == 0 and len(w.frames) > 4 * FPS and 'live=true' in w.head, (w.status, len(w.frames), w.errors))
    check('is quiet', w['stalls'] + w['breaks'] + w['reconnects'] == 0, w.counts)
    return f'{len(w.frames)} frames, {w.head[2:]}'


def frozen(small, _):
    with rtsp(small) as server:
        w = Watch(f'rtsp://127.0.0.1:{server.port}/clip.mp4', 22)
        time.sleep(5)
        server.signal(signal.SIGSTOP)
        time.sleep(5)
        server.signal(signal.SIGCONT)
        w.end()
    check('comes back', w.status == 0 and w['stalls'] >= 1 and w['reconnects'] >= 1, (w.status, w.counts, w.errors))
    check('knows how long it was', 4 < w.gap() < 14 and abs(w.gap() - w['longest_gap_s']) < 1.5, (w.gap(), w.counts))
    return f'{len(w.frames)} frames, a gap of {w.gap():.1f} s'


def restarted(small, _):
    with rtsp(small) as server:
        w = Watch(f'rtsp://127.0.0.1:{server.port}/clip.mp4', 22)
        time.sleep(5)
        server.kill()
        time.sleep(2)
        server.start()
        w.end()
    check('comes back', w.status == 0 and w['breaks'] == 1 and w['reconnects'] == 1 and len(w.frames) > 5 * FPS, (w.status, w.counts, w.errors))
    check('knows how long it was', 1.5 < w.gap() < 14, w.gap())
    return f'{len(w.frames)} frames, a gap of {w.gap():.1f} s, {w["failed_attempts"]:.0f} attempts in vain'


def killed(small, _):
    with rtsp(small) as server:
        w = Watch(f'rtsp://127.0.0.1:{server.port}/clip.mp4', 90, 1, 4)
        time.sleep(5)
        server.kill()
        began = time.monotonic()
        w.end()
    check('gives up', w.status == 3 and 'attempts to connect again' in w.errors, (w.status, w.errors))
    check('in time', time.monotonic() - began < 30, time.monotonic() - began)
    return w.errors.strip()


def at_once(small, _):
    with rtsp(small) as server:
        w = Watch(f'rtsp://127.0.0.1:{server.port}/clip.mp4', 90, 1, 0)
        time.sleep(5)
        server.kill()
        w.end()
    check('gives up', w.status == 3 and 'breaks off' in w.errors and 'again' not in w.errors, (w.status, w.errors))
    return w.errors.strip()


def another_size(small, big):
    with rtsp(small) as server:
        w = Watch(f'rtsp://127.0.0.1:{server.port}/clip.mp4', 90)
        time.sleep(5)
        server.kill()
        with rtsp(big, server.port):
            w.end()
    check('says so', w.status == 3 and '640x480' in w.errors and '320x240' in w.errors, (w.status, w.errors))
    return w.errors.strip()


def web_file(small, _):
    with web(small) as server:
        w = Watch(f'http://127.0.0.1:{server.port}/clip.mp4', 90).end()
    check('drops nothing', w.status == 0 and len(w.frames) == FPS * SECONDS and 'live=false' in w.head, (w.status, len(w.frames), w.head))
    return f'{len(w.frames)} frames, {w.head[2:]}'


def speaker(answer):
    """A server that says what it likes."""
    listener = socket.create_server(('127.0.0.1', 0))

    def serve():
        while True:
            connection, _ = listener.accept()
            with contextlib.suppress(OSError), connection:
                connection.recv(4096)
                answer(connection)
    threading.Thread(target=serve, daemon=True).start()
    return listener.getsockname()[1]


def guarded(port, scheme):
    """Asks for user and password (RFC 2617) before it lets RTSP through to the server on `port`."""
    listener, nonce = socket.create_server(('127.0.0.1', 0)), secrets.token_hex(8)
    md5 = lambda text: hashlib.md5(text.encode()).hexdigest()

    def knows(method, header):
        kind, _, rest = header.partition(' ')
        if kind == 'Basic' == scheme:
            return base64.b64decode(rest) == f'{USER}:{PASSWORD}'.encode()
        fields = dict(re.findall(r'(\w+)="?([^",]*)"?', rest))
        middle = ''.join(fields[k] + ':' for k in ('nc', 'cnonce', 'qop')) if 'qop' in fields else ''
        wanted = md5(f'{md5(f"{USER}:camera:{PASSWORD}")}:{nonce}:{middle}{md5(method + ":" + fields.get("uri", ""))}')
        return kind == 'Digest' == scheme and fields.get('response') == wanted

    def pipe(source, sink):
        with contextlib.suppress(OSError):
            while data := source.recv(1 << 16):
                sink.sendall(data)
        for end in (source, sink):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def serve(client):
        with contextlib.suppress(OSError), client, socket.create_connection(('127.0.0.1', port)) as server:
            threading.Thread(target=pipe, args=(server, client), daemon=True).start()
            data, playing = b'', False
            while not playing:
                while b'\r\n\r\n' not in data:
                    more = client.recv(4096)
                    if not more:
                        return
                    data += more
                request, _, data = data.partition(b'\r\n\r\n')
                lines = request.decode().split('\r\n')
                fields = {k.lower(): v.strip() for k, _, v in (line.partition(':') for line in lines[1:])}
                method = lines[0].split()[0]
                if knows(method, fields.get('authorization', '')):
                    server.sendall(request + b'\r\n\r\n')
                    playing = method == 'PLAY'
                else:
                    asked = f'{scheme} realm="camera"' + (f', nonce="{nonce}"' if scheme == 'Digest' else '')
                    client.sendall(f'RTSP/1.0 401 Unauthorized\r\nCSeq: {fields["cseq"]}\r\nWWW-Authenticate: {asked}\r\n\r\n'.encode())
            server.sendall(data)
            pipe(client, server)

    def listen():
        while True:
            threading.Thread(target=serve, args=(listener.accept()[0],), daemon=True).start()
    threading.Thread(target=listen, daemon=True).start()
    return listener.getsockname()[1]


def password(small, _):
    said = []
    with rtsp(small) as server:
        for scheme in ('Basic', 'Digest'):
            port = guarded(server.port, scheme)
            known = Watch(f'rtsp://{USER}:{urllib.parse.quote(PASSWORD, safe="")}@127.0.0.1:{port}/clip.mp4', 8)
            time.sleep(3)
            listed = subprocess.run(['ps', '-eo', 'ppid,args'], capture_output=True, text=True).stdout.splitlines()
            children = [line for line in listed if line.split()[0] == str(known.process.pid)]
            check('tells no other process', not any('s3same' in line for line in children), children)
            known.end()
            check(f'{scheme} plays', known.status == 0 and len(known.frames) > 3 * FPS, (known.status, len(known.frames), known.errors))
            other = Watch(f'rtsp://{USER}:s3same-wrong@127.0.0.1:{port}/clip.mp4', 8, 1, 0).end()
            check(f'{scheme} refuses', other.status == 3 and not other.frames, (other.status, other.errors))
            shown = known.head + known.errors + other.errors
            check('shows no password', 's3same' not in shown, shown)
            said.append(f'{scheme} {len(known.frames)} frames')
    return ', '.join(said) + '; ' + other.errors.strip()[-120:]


def live_playlist(small, _):
    with tempfile.TemporaryDirectory() as folder, web(folder) as server:
        record = [FFMPEG, '-nostdin', '-v', 'error', '-re', '-stream_loop', '-1', '-i', f'{small}/clip.mp4', '-c', 'copy', '-f', 'hls', '-hls_time', '1',
                  '-hls_list_size', '4', '-hls_flags', 'delete_segments', f'{folder}/live.m3u8']
        camera = subprocess.Popen(record)
        try:
            while not os.path.exists(f'{folder}/live.m3u8'):
                time.sleep(0.1)
            time.sleep(4)
            w = Watch(f'http://127.0.0.1:{server.port}/live.m3u8', 60, 4, 6)
            time.sleep(10)
            camera.kill()
            server.kill()
            w.end()
        finally:
            camera.kill()
            camera.wait()
    check('is live', 'live=true' in w.head and len(w.frames) > 4 * FPS, (w.head, len(w.frames), w.errors))
    check('says that nothing comes any more', w.status == 3 and w['stalls'] + w['breaks'] >= 1, (w.status, w.counts, w.errors))
    return f'{len(w.frames)} frames; {w.errors.strip()[-120:]}'


def slow_web_file(small, _):
    content = open(f'{small}/clip.mp4', 'rb').read()

    def answer(connection):
        connection.sendall(b'HTTP/1.0 200 OK\r\nContent-Length: %d\r\n\r\n' % len(content))
        for at in range(0, len(content), len(content) // 40):
            connection.sendall(content[at:at + len(content) // 40])
            time.sleep(0.2)
    w = Watch(f'http://127.0.0.1:{speaker(answer)}/clip.mp4', 90, 1, 5).end()
    check('waits', w.status == 0 and len(w.frames) == FPS * SECONDS, (w.status, len(w.frames), w.errors))
    return f'{len(w.frames)} frames'


def cut_web_file(small, _):
    content = open(f'{small}/clip.mkv', 'rb').read()

    def answer(connection):
        connection.sendall(b'HTTP/1.0 200 OK\r\nContent-Length: %d\r\n\r\n' % len(content))
        connection.sendall(content[:len(content) // 2])
    w = Watch(f'http://127.0.0.1:{speaker(answer)}/clip.mkv', 90, 1, 0).end()
    check('says so', w.status == 3 and 5 * FPS < len(w.frames) < FPS * SECONDS, (w.status, len(w.frames), w.errors))
    return f'{len(w.frames)} frames; {w.errors.strip()[-120:]}'


def garbage(_, __):
    def answer(connection):
        connection.sendall(os.urandom(200_000))
    port = speaker(answer)
    for url in [f'rtsp://127.0.0.1:{port}/x', f'http://127.0.0.1:{port}/x.mp4']:
        w = Watch(url, 90, 1, 2).end()
        check('is refused', w.status == 3 and not w.frames, (w.status, w.errors))
    return w.errors.strip()[:100]


def silence(_, __):
    port = speaker(lambda _: time.sleep(100))
    began = time.monotonic()
    w = Watch(f'rtsp://127.0.0.1:{port}/x', 90, 1, 2).end()
    check('is given up', w.status == 3 and time.monotonic() - began < 40, (w.status, w.errors))
    return w.errors.strip()


def main():
    folder = tempfile.mkdtemp(prefix='pursuit-streams-')
    try:
        small, big = f'{folder}/small', f'{folder}/big'
        for at, size in [(small, '320x240'), (big, '640x480')]:
            os.mkdir(at)
            film(f'{at}/clip.mp4', size, '-movflags', '+faststart')
        film(f'{small}/clip.mkv', '320x240')
        tests = [playing, frozen, restarted, killed, at_once, another_size, web_file, slow_web_file, cut_web_file, garbage, silence, password, live_playlist]
        failed = 0
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            for test, run in [(t, pool.submit(functools.partial(t, small, big))) for t in tests]:
                try:
                    print(f'ok      {test.__name__:14} {run.result()}')
                except Exception as error:
                    failed += 1
                    print(f'FAILED  {test.__name__:14} {error!r}')
        sys.exit(failed > 0)
    finally:
        shutil.rmtree(folder)


main()
