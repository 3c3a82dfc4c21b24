#!/usr/bin/env python3
"""Our ONVIF driver against a camera simulator that we did not write (ipycam, MIT): the example `drive` moves its head.

usage (from the repository): cargo xtask peers onvif; needs, from PyPI: ipycam, numpy, opencv-python-headless

The simulator checks WS-UsernameToken digests and how old they are. Judged by what its head did: every command arrives, and the
head stands when the program has ended in mid-move. Then a wrong password, a clock an hour off, and a camera that hangs up in
mid-move: an error in time, and the password in no output. All commands once more over HTTPS, where the camera's own certificate is
trusted by its file, and by nothing else (where there is openssl).
"""
import calendar, datetime, json, os, socket, socketserver, ssl, subprocess, sys, tempfile, threading, time
import ipycam.onvif
from ipycam.config import CameraConfig
from ipycam.http import IPCameraHTTPHandler
from ipycam.onvif import ONVIFService
from ipycam.ptz import PTZController

SECRET = 'open-sesame-3141'
CALLS = ['continuous_move', 'stop_movement', 'absolute_move', 'relative_move', 'goto_home']


class Camera:
    """The parts of the simulator that answer ONVIF; no video."""

    def __init__(self, certificate=None):
        self.scheme = 'onvifs' if certificate else 'onvif'
        self.config = CameraConfig(local_ip='127.0.0.1', username='admin', password=SECRET)
        self.ptz = PTZController()
        self.onvif = ONVIFService(self.config, self.ptz)
        self.heard, self.hang_up_after = [], None
        for name in CALLS:
            setattr(self.ptz, name, self.noting(name, getattr(self.ptz, name)))
        camera = self

        class Handler(IPCameraHTTPHandler):
            def date_time_string(self, timestamp=None):
                # A camera has one clock.
                return super().date_time_string(calendar.timegm(time.gmtime()))

            def do_POST(self):
                if camera.hang_up_after is not None and len(camera.heard) >= camera.hang_up_after:
                    self.connection.shutdown(socket.SHUT_RDWR)
                    self.close_connection = True
                    return
                super().do_POST()

        Handler.camera = self

        class Server(socketserver.ThreadingTCPServer):
            daemon_threads, allow_reuse_address = True, True

            def handle_error(self, *_):
                pass

        self.server = Server(('127.0.0.1', 0), Handler)
        if certificate:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(certificate)
            self.server.socket = context.wrap_socket(self.server.socket, server_side=True)
        self.config.onvif_port = self.server.server_address[1]
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def noting(self, name, call):
        def noted(*args, **kwargs):
            self.heard.append((name, args))
            return call(*args, **kwargs)
        return noted

    def drive(self, user='admin', password=SECRET, trusted=None):
        began = time.monotonic()
        command = [os.environ['DRIVE'], f'{self.scheme}://{user}@127.0.0.1:{self.config.onvif_port}', '0.2']
        environment = {**os.environ, 'PURSUIT_PTZ_PASSWORD': password, **({'PURSUIT_PTZ_CA': trusted} if trusted else {})}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
        assert password not in done.stdout + done.stderr, 'the password is shown'
        assert done.returncode == 0 and 'panicked' not in done.stderr, done.stderr
        return [json.loads(line) for line in done.stdout.splitlines()], time.monotonic() - began


def main():
    camera = Camera()
    lines, _ = camera.drive()
    assert lines[0]['open'] is None, lines[0]
    bad = [line for line in lines[1:] if line['error']]
    assert not bad, bad
    names = [name for name, _ in camera.heard]
    print('heard', names)
    for name in CALLS:
        assert name in names, f'{name} never arrived'
    move = next(args for name, args in camera.heard if name == 'continuous_move')
    assert move[0] > 0 and move[1] == 0, move
    assert names[-1] == 'stop_movement' and not camera.ptz.get_status()['moving'], 'the head goes on when the program has ended'

    wrong, took = Camera().drive(password='not-' + SECRET[::-1])
    print('wrong password:', wrong[0]['open'])
    assert len(wrong) == 1 and wrong[0]['open'] and took < 30

    # The camera's clock is an hour behind ours: tokens dated by ours would be stale.
    class Behind(datetime.datetime):
        @classmethod
        def now(cls, zone=None):
            return datetime.datetime.now(zone) - datetime.timedelta(hours=1)

    real, gmtime = ipycam.onvif.datetime, ipycam.onvif.time.gmtime
    ipycam.onvif.datetime = Behind
    ipycam.onvif.time.gmtime = lambda s=None: gmtime((time.time() if s is None else s) - 3600)
    skewed, _ = Camera().drive()
    ipycam.onvif.datetime, ipycam.onvif.time.gmtime = real, gmtime
    print('clock an hour behind:', skewed[0]['open'] or 'all commands taken')

    camera = Camera()
    camera.hang_up_after = 1
    cut, took = camera.drive()
    print('hangs up in mid-move:', cut[2]['error'] if len(cut) > 2 else cut[0]['open'])
    assert any(line.get('error') for line in cut[1:]) and all(line['took_s'] < 10 for line in cut[1:])
    if skewed[0]['open'] or any(line['error'] for line in skewed[1:]):
        sys.exit('a camera whose clock is off is not reached')
    secret()
    print('ok')


def secret():
    """All commands over HTTPS."""
    with tempfile.TemporaryDirectory() as folder:
        pem = os.path.join(folder, 'camera.pem')
        make = ['openssl', 'req', '-x509', '-newkey', 'rsa:2048', '-nodes', '-days', '2', '-subj', '/CN=camera', '-keyout', pem, '-out', pem + '.crt']
        try:
            subprocess.run(make, check=True, capture_output=True)
        except (OSError, subprocess.CalledProcessError):
            return print('skipped: HTTPS, there is no openssl that makes certificates')
        with open(pem, 'a') as both, open(pem + '.crt') as certificate:
            both.write(certificate.read())
        camera = Camera(pem)
        lines, _ = camera.drive(trusted=pem + '.crt')
        assert lines[0]['open'] is None and not any(line['error'] for line in lines[1:]), lines
        assert camera.heard[-1][0] == 'stop_movement'
        strange, _ = Camera(pem).drive()
        print('not trusted:', strange[0]['open'][:70])
        assert 'not trusted' in strange[0]['open'], strange


if __name__ == '__main__':
    main()
