"""mocap-web with real daemons, fake feeds and hostile clients."""

import contextlib
import http.client
import json
import re
import shutil
import socket
import subprocess
import time
import unittest

from fake_feed import FakeFeed, description_pb2, health_pb2, snapshot_pb2
from harness import SOURCE, Desk, synthetic_volume
import mocap.v1.preview_pb2 as preview_pb2  # fake_feed has set the path
import mocap.v1.sightings_pb2 as sightings_pb2
from websocket_client import BINARY, PING, TEXT, WebSocket, frame, trust

LIMIT_S = 120
FOXGLOVE_LIBRARY = SOURCE / "tests" / "web" / "npm" / "node_modules" / "@foxglove" / "ws-protocol"


def wait_until(holds, what):
    limit = time.monotonic() + LIMIT_S
    while not holds():
        if time.monotonic() > limit:
            raise AssertionError(f"not within {LIMIT_S} s: {what}")
        time.sleep(0.05)


class Web:
    """A running mocap-web."""

    def __init__(self, desk, *arguments):
        self.program = desk.start("mocap-web", *arguments, "--port", 0)
        wait_until(lambda: "http" in self.program.output() or self.program.process.poll() is not None, "the address of the page")
        found = re.search(r"^mocap-web: (https?)://\S+:(\d+)$", self.program.output(), re.MULTILINE)
        assert found, self.program.output()
        self.port = int(found.group(2))

    def ask(self, method, path, body=None, headers=None, tls=None):
        """Returns status, headers and body."""
        if tls:
            connection = http.client.HTTPSConnection("127.0.0.1", self.port, timeout=LIMIT_S, context=tls)
        else:
            connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=LIMIT_S)
        connection.request(method, path, body=body, headers=headers or {})
        reply = connection.getresponse()
        text = reply.read()
        connection.close()
        return reply.status, dict(reply.getheaders()), text

    def get(self, path, **headers):
        return self.ask("GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()})

    def post(self, method, params, **headers):
        status, _, text = self.ask("POST", f"/api/v1/{method}", json.dumps(params),
                                   {"Content-Type": "application/json", **{n.replace("_", "-"): v for n, v in headers.items()}})
        return status, json.loads(text)

    def open_page(self, **more):
        return WebSocket(self.port, timeout_s=LIMIT_S, **more)

    def raw(self, data=b""):
        connection = socket.create_connection(("127.0.0.1", self.port), LIMIT_S)
        connection.sendall(data)
        return connection

    def metric(self, name):
        text = self.get("/metrics")[2].decode()
        found = re.search(rf"^{re.escape(name)} (\S+)$", text, re.MULTILINE)
        return float(found.group(1)) if found else None

    def refused(self, reason):
        return self.metric(f'mocap_web_refused_total{{reason="{reason}"}}') or 0


def read_all(connection):
    """What the server sends until it ends the connection."""
    said = b""
    try:
        while more := connection.recv(65536):
            said += more
    except ConnectionResetError:
        pass
    connection.close()
    return said


class WithFakeFeed(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def start(self, *arguments, **options):
        feed = FakeFeed(**options)
        self.addCleanup(feed.close)
        return feed, Web(self.desk, feed.endpoint, *arguments)


class Page(WithFakeFeed):
    def test_serves_the_page_with_headers_that_protect_it(self):
        _, web = self.start()

        status, headers, body = web.get("/")

        self.assertEqual(status, 200)
        self.assertIn(b"<html", body)
        self.assertIn("default-src 'self'", headers["Content-Security-Policy"])
        self.assertNotIn("unsafe", headers["Content-Security-Policy"])
        self.assertEqual(headers["X-Content-Type-Options"], "nosniff")
        self.assertEqual(web.get("/none")[0], 404)
        self.assertEqual(web.ask("POST", "/")[0], 405)
        self.assertEqual(web.ask("HEAD", "/")[2], b"")
        self.assertEqual(web.get("/", If_None_Match=headers["ETag"])[0], 304)

    def test_a_page_receives_the_feeds_own_messages(self):
        _, web = self.start()
        page = web.open_page()
        self.assertEqual(page.headers["sec-websocket-protocol"], "mocap.v1")

        page.send({"subscribe": ["description", "snapshot", "health"]})

        said = description_pb2.Description.FromString(page.wait_for_topic("description"))
        self.assertEqual(said.subjects[0].name, "actor")
        self.assertGreater(snapshot_pb2.Snapshot.FromString(page.wait_for_topic("snapshot")).number, 0)
        self.assertEqual(health_pb2.Health.FromString(page.wait_for_topic("health")).cameras[0].name, "north")

    def test_the_next_snapshot_comes_only_after_the_page_has_drawn(self):
        feed, web = self.start()
        page = web.open_page()
        page.send({"subscribe": ["snapshot", "health"]})
        first = snapshot_pb2.Snapshot.FromString(page.wait_for_topic("snapshot")).number

        sent = feed.sent
        wait_until(lambda: feed.sent > sent + 50, "fifty snapshots of the feed")
        page.wait_for_topic("health")
        dropped = page.wait_for_text("dropped")["snapshot"]
        page.send({"drawn": first})
        second = snapshot_pb2.Snapshot.FromString(page.wait_for_topic("snapshot")).number

        self.assertGreater(second, first + 50)
        self.assertGreater(dropped, 0)

    def test_state_follows_the_daemon(self):
        feed, web = self.start()
        page = web.open_page()
        connected = page.wait_for(lambda message: isinstance(message, dict) and message.get("state", {}).get("connected"))["state"]
        self.assertEqual((connected["endpoint"], connected["reason"], connected["role"]), (feed.endpoint, "", "operator"))
        self.assertEqual(web.get("/readyz")[0], 200)

        feed.close()

        gone = page.wait_for(lambda message: isinstance(message, dict) and not message.get("state", {"connected": True})["connected"])["state"]
        self.assertIn(feed.endpoint, gone["reason"])
        wait_until(lambda: web.get("/readyz")[0] == 503, "not ready")
        self.assertEqual(web.get("/healthz")[0], 200)
        self.assertEqual(web.metric("mocap_up"), 0)
        again = FakeFeed(port=feed.port, session="second")
        self.addCleanup(again.close)
        page.wait_for(lambda message: isinstance(message, dict) and message.get("state", {}).get("connected"))
        page.send({"subscribe": ["description"]})
        self.assertEqual(description_pb2.Description.FromString(page.wait_for_topic("description")).session_id, "second")

    def test_metrics_are_valid(self):
        _, web = self.start(cameras={"north": 2, 'a "quoted" name': 3})
        wait_until(lambda: web.metric("mocap_up") == 1, "the first health")

        status, headers, text = web.get("/metrics")

        self.assertEqual((status, headers["Content-Type"]), (200, "text/plain; version=0.0.4; charset=utf-8"))
        self.assertEqual(web.metric('mocap_camera_streaming{camera="north"}'), 1)
        self.assertEqual(web.metric('mocap_camera_streaming{camera="a \\"quoted\\" name"}'), 0)
        if shutil.which("promtool") is None:
            self.skipTest("promtool is not installed (apt-get install prometheus)")
        checked = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True, check=False)
        self.assertEqual((checked.returncode, checked.stderr), (0, b""), checked.stdout)


class Monitoring(WithFakeFeed):
    FOLDER = SOURCE / "tools/web/monitoring"

    def test_rules_and_dashboard_use_metrics_that_exist(self):
        used = set()
        for name in ("mocap.rules.yml", "mocap.rules_test.yml", "grafana.json"):
            used |= set(re.findall(r"\bmocap_[a-z0-9_]+\b", (self.FOLDER / name).read_text()))
        table = (SOURCE / "tools/web/metrics/metric_table.cpp").read_text() + (SOURCE / "tools/web/metrics/metrics.cpp").read_text()

        self.assertEqual({name for name in used if f'"{name}"' not in table}, set())
        self.assertGreater(len(used), 20)

    def test_alerts_fire_when_they_should(self):
        if shutil.which("promtool") is None:
            self.skipTest("promtool is not installed (apt-get install prometheus)")
        ended = subprocess.run(["promtool", "test", "rules", "mocap.rules_test.yml"], cwd=self.FOLDER, capture_output=True, text=True, check=False)
        self.assertEqual(ended.returncode, 0, ended.stdout + ended.stderr)


class Hostile(WithFakeFeed):
    def healthy(self, web):
        """The server still answers others."""
        self.assertEqual(web.get("/healthz")[0], 200)

    def test_pages_of_other_sites_are_refused(self):
        _, web = self.start()
        good = f"127.0.0.1:{web.port}"

        self.assertEqual(web.get("/", Host="evil.example")[0], 421)
        self.assertEqual(web.get("/api/v1/status", Host=f"evil.example:{web.port}")[0], 421)
        self.assertEqual(web.get("/api/v1/status", Host=good, Origin="http://evil.example")[0], 403)
        self.assertEqual(web.get("/api/v1/status", Host=good, Sec_Fetch_Site="cross-site")[0], 403)
        self.assertEqual(web.open_page(headers={"Origin": "http://evil.example"}).status, 403)
        self.assertEqual(web.open_page(headers={"Host": "evil.example"}).status, 421)
        self.assertEqual(web.open_page(headers={"Origin": f"http://{good}"}).status, 101)
        self.assertEqual(web.ask("POST", "/api/v1/capture", '{"action":"ACTION_STOP"}', {"Content-Type": "text/plain"})[0], 415)
        self.assertGreater(web.refused("foreign"), 0)

    def test_websockets_without_the_subprotocol_are_refused(self):
        _, web = self.start()

        self.assertEqual(web.open_page(headers={"Sec-WebSocket-Protocol": None}).status, 400)
        self.assertEqual(web.open_page(headers={"Sec-WebSocket-Protocol": "other"}).status, 400)
        self.assertEqual(web.get("/ws")[0], 426)

    def test_large_and_malformed_requests_are_refused(self):
        _, web = self.start()
        host = b"Host: 127.0.0.1\r\n"
        for data, status in ((b"GET / HTTP/1.1\r\n" + host + b"X: " + b"a" * 20000 + b"\r\n\r\n", b" 431 "),
                             (b"GET /" + b"a" * 20000 + b" HTTP/1.1\r\n" + host + b"\r\n", b" 431 "),
                             (b"POST /api/v1/take HTTP/1.1\r\n" + host + b"Content-Length: 99999999\r\n\r\n", b" 413 "),
                             (b"GET / HTTP/1.1\r\nHost 127.0.0.1\r\n\r\n", b" 400 "),
                             (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", b" 400 "),
                             (b"\0" * 100, b" 400 ")):
            with self.subTest(status):
                connection = web.raw(data)
                with contextlib.suppress(OSError):
                    connection.shutdown(socket.SHUT_WR)
                self.assertIn(status, read_all(connection).split(b"\r\n")[0])
        self.healthy(web)

    def test_silent_and_slow_clients_are_cut(self):
        _, web = self.start("--timeout-s", 1)
        silent = web.raw()
        half = web.raw(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ")
        idle = web.raw(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        trickle = web.raw(b"G")

        def fed():  # a byte now and then does not extend the time
            try:
                trickle.sendall(b"E")
                return False
            except OSError:
                return True
        wait_until(fed, "the end of a trickling client")
        self.assertEqual(read_all(silent), b"")
        self.assertEqual(read_all(half), b"")
        self.assertIn(b" 200 ", read_all(idle))
        self.healthy(web)

    def test_a_page_that_is_gone_without_a_word_is_cut(self):
        _, web = self.start("--timeout-s", 1)
        page = web.open_page()  # answers no ping, as a machine that was switched off

        wait_until(lambda: web.metric("mocap_web_viewers") == 0, "the end of the half-open page")
        page.close()

    def test_a_page_that_does_not_read_is_cut_and_costs_the_others_nothing(self):
        feed, web = self.start("--timeout-s", 2, points=[(0.0, 0.0, float(i)) for i in range(900)])
        stalled = web.open_page()
        stalled.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        stalled.send({"subscribe": ["snapshot", "health"]})
        good = web.open_page()
        good.send({"subscribe": ["snapshot"]})
        seen = 0

        def one_left():
            nonlocal seen
            good.wait_for_topic("snapshot")
            good.send({"drawn": 1})
            seen += 1
            with_stalled_acknowledged()
            return seen % 50 == 0 and web.metric("mocap_web_viewers") == 1

        def with_stalled_acknowledged():
            try:
                stalled.socket.sendall(frame(TEXT, b'{"drawn":1}'))  # it claims to draw, but reads nothing
            except OSError:
                pass

        wait_until(one_left, "the stalled page is cut")
        self.assertGreater(seen, 50)
        self.healthy(web)

    def test_floods_are_cut(self):
        _, web = self.start()
        for flood in (frame(TEXT, b'{"drawn":1}') * 2000, frame(PING, b"x") * 2000):
            page = web.open_page()
            try:
                page.socket.sendall(flood)
            except OSError:
                pass
            page.wait_for_end()
        requests = web.raw()
        try:
            requests.sendall(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 400)
        except OSError:
            pass
        self.assertIn(b" 429 ", read_all(requests))
        self.assertGreaterEqual(web.refused("flood"), 3)

    def test_too_many_connections_are_refused_and_others_return(self):
        _, web = self.start()
        held = [web.raw() for _ in range(100)]

        wait_until(lambda: read_one(held[-1]), "the refusal of one connection too many")
        for connection in held:
            connection.close()

        def answers():
            try:
                return web.get("/healthz")[0] == 200
            except OSError:
                return False
        wait_until(answers, "an answer after the flood of connections")

    def test_malformed_websocket_frames_end_the_connection_alone(self):
        _, web = self.start()
        cases = {
            "unmasked": frame(TEXT, b"{}", masked=False),
            "reserved bit": frame(TEXT, b"{}", reserved=4),
            "unknown opcode": frame(3, b"{}"),
            "unknown control opcode": frame(11, b""),
            "continuation without a start": frame(0, b"{}"),
            "fragmented ping": frame(PING, b"", fin=False),
            "long ping": frame(PING, b"x" * 126),
            "second start within a message": frame(TEXT, b"{", fin=False) + frame(TEXT, b"}"),
            "invalid UTF-8": frame(TEXT, b"\xff\xfe"),
            "claimed size over the limit": frame(TEXT, b"{}", length=1 << 40),
            "size with the highest bit": b"\x81\xff" + b"\xff" * 8 + b"\0" * 4,
            "message over the limit": frame(TEXT, b" " * 70000),
            "close with one byte": frame(8, b"\x03"),
            "close with a reserved code": frame(8, b"\x03\xed"),
        }
        for name, data in cases.items():
            with self.subTest(name):
                page = web.open_page()
                page.socket.sendall(data)
                code = page.wait_for_end()
                self.assertIn(code, (None, 1002, 1007, 1009), name)
        self.healthy(web)

    def test_good_frames_of_every_form_are_accepted(self):
        _, web = self.start()
        page = web.open_page()
        subscribe = b'{"subscribe":["health"]}'

        page.socket.sendall(frame(TEXT, subscribe[:5], fin=False) + frame(PING, b"between") + frame(0, b"", fin=False) +
                            frame(0, subscribe[5:]))
        page.wait_for_topic("health")
        page.socket.sendall(frame(TEXT, b'{"drawn":' + b" " * 60000 + b"1}"))  # 16-bit length
        page.socket.sendall(frame(8, b"\x03\xe8bye"))

        self.assertEqual(page.wait_for_end(), 1000)

    def test_invalid_messages_of_a_page_are_answered(self):
        _, web = self.start()
        page = web.open_page()
        for data in (frame(TEXT, b"no json"), frame(BINARY, b"{}"), frame(TEXT, b'{"subscribe":["secret"]}'), frame(TEXT, b"[" * 60000)):
            page.socket.sendall(data)
            self.assertEqual(page.wait_for_text("answer")["ok"], False)
        self.assertEqual(page.ask(1, "nonsense")["error"]["code"], "CODE_NOT_FOUND")


def read_one(connection):
    """Whether the server has ended the connection."""
    connection.settimeout(1)
    try:
        return connection.recv(1) == b""
    except TimeoutError:
        return False
    except OSError:
        return True


class Security(WithFakeFeed):
    def test_other_machines_need_tls_and_a_token(self):
        for arguments, hint in ((["--listen", "0.0.0.0"], "mocap-web cert"),
                                (["--listen", "0.0.0.0", "--certificate", "web.crt", "--private-key", "web.key"], "mocap-web token")):
            self.desk.run("mocap-web", "cert", "web")
            ended = self.desk.run("mocap-web", *arguments)
            self.assertEqual(ended.returncode, 64)
            self.assertIn(hint, ended.stderr)

    def test_tokens_have_roles_over_tls(self):
        self.desk.run("mocap-web", "cert", "web")
        viewer = self.desk.run("mocap-web", "token", "web.tokens", "screen").stdout.strip()
        boss = self.desk.run("mocap-web", "token", "web.tokens", "anna", "--role", "operator").stdout.strip()
        self.assertNotIn(boss, (self.desk.folder / "web.tokens").read_text())
        _, web = self.start("--listen", "0.0.0.0", "--certificate", "web.crt", "--private-key", "web.key", "--tokens", "web.tokens")
        tls = trust(self.desk.folder / "web.crt")

        def ask(method, path, token=None, body=None):
            headers = {"Content-Type": "application/json"} if body else {}
            if token:
                headers["Authorization"] = f"Bearer {token}"
            return web.ask(method, path, body, headers, tls)

        self.assertEqual(ask("GET", "/healthz")[0], 200)
        self.assertEqual(ask("GET", "/readyz")[2].strip() in (b"ready", b"not ready"), True)
        for path in ("/", "/metrics", "/api/v1/status", "/api/v1/openapi.json"):
            self.assertEqual(ask("GET", path)[0], 401, path)
            self.assertEqual(ask("GET", path, "wrong")[0], 401, path)
        self.assertEqual(ask("GET", "/", viewer)[0], 200)
        self.assertEqual(ask("POST", "/api/v1/capture", viewer, '{"action":"ACTION_STOP"}')[0], 403)
        self.assertNotEqual(ask("POST", "/api/v1/capture", boss, '{"action":"ACTION_STOP"}')[0], 403)
        status, headers, _ = ask("GET", f"/?token={viewer}")
        self.assertEqual((status, headers["Location"]), (303, "/"))
        self.assertRegex(headers["Set-Cookie"], r"HttpOnly; Secure; SameSite=Strict$")
        cookie = headers["Set-Cookie"].split(";")[0]
        page = WebSocket(web.port, {"Cookie": cookie}, LIMIT_S, tls)
        self.assertEqual(page.wait_for_text("state")["role"], "viewer")
        self.assertEqual(page.ask(1, "capture", {"action": "ACTION_STOP"})["error"]["code"], "CODE_FORBIDDEN")
        self.assertEqual(WebSocket(web.port, None, LIMIT_S, tls).status, 401)
        self.assertRegex(web.program.output(), r"audit: who=anna role=operator from=127\.0\.0\.1:\d+ method=capture "
                                               r'params=\{"action":"ACTION_STOP"\} answer=CODE_FAILED')

    def test_files_that_exist_are_not_replaced(self):
        self.assertEqual(self.desk.run("mocap-web", "cert", "web").returncode, 0)
        before = (self.desk.folder / "web.key").read_bytes()

        self.assertEqual(self.desk.run("mocap-web", "cert", "web").returncode, 73)

        self.assertEqual((self.desk.folder / "web.key").read_bytes(), before)

    def test_a_role_for_everyone_without_tokens(self):
        _, web = self.start("--role", "viewer")

        self.assertEqual(web.post("capture", {"action": "ACTION_STOP"})[0], 403)


FOXGLOVE = {"Sec-WebSocket-Protocol": "foxglove.websocket.v1"}


class FoxgloveAccess(WithFakeFeed):
    def test_the_newer_name_of_the_protocol_is_preferred(self):
        _, web = self.start()
        client = web.open_page(path="/", headers={"Sec-WebSocket-Protocol": "foxglove.websocket.v1, foxglove.sdk.v1"})
        self.assertEqual(client.headers["sec-websocket-protocol"], "foxglove.sdk.v1")
        self.assertEqual(client.receive()["op"], "serverInfo")

    def test_only_listed_sites_may_read(self):
        _, web = self.start("--origin", "https://App.Foxglove.dev")
        foreign = {"Origin": "https://app.foxglove.dev", "Sec-Fetch-Site": "cross-site"}
        self.assertEqual(web.open_page(path="/", headers=FOXGLOVE | foreign).status, 101)
        self.assertEqual(web.open_page(headers=foreign).status, 403, "the protocol of the page, which can change the daemon")
        self.assertEqual(web.open_page(headers=FOXGLOVE | {"Origin": "https://evil.example"}).status, 403)

    def test_a_token_is_needed_where_there_are_tokens(self):
        tokens = self.desk.folder / "web.tokens"
        token = self.desk.run("mocap-web", "token", tokens, "anna").stdout.strip()
        _, web = self.start("--tokens", tokens)
        self.assertEqual(web.open_page(path="/", headers=FOXGLOVE).status, 401)
        self.assertEqual(web.open_page(path=f"/?token={token}", headers=FOXGLOVE).status, 101)

    def test_an_origin_without_a_scheme_is_refused_at_the_start(self):
        done = self.desk.run("mocap-web", "--origin", "app.foxglove.dev")
        self.assertEqual(done.returncode, 64)
        self.assertIn("expected a site as https://HOST", done.stderr)


class BesideDaemon(unittest.TestCase):
    marker_set = "openmocap18"

    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        config = self.desk.write("my.toml", synthetic_volume(self.desk.endpoint).replace("openmocap18", self.marker_set))
        self.daemon = self.desk.start("mocapd", "--config", config)
        self.web = Web(self.desk, self.desk.endpoint)
        wait_until(lambda: self.web.get("/readyz")[0] == 200, "the daemon's feed")


class WithDaemon(BesideDaemon):
    def test_the_api_is_the_control_protocol(self):
        paths = json.loads(self.web.get("/api/v1/openapi.json")[2])["paths"]
        for path, operations in paths.items():
            if "/takes" in path or path in ("/api/v1/preflight", "/api/v1/subjects/import"):
                continue  # below
            (method,) = operations
            with self.subTest(path):
                if method == "get":
                    status, _, text = self.web.get(path)
                    self.assertEqual((status, json.loads(text)["code"]), (200, "CODE_DONE"))
                else:
                    self.assertEqual(self.web.get(path)[0], 405)
                    status, answer = self.web.post(path.rpartition("/")[2], {"nonsense": 1})
                    self.assertEqual((status, answer["code"]), (400, "CODE_INVALID"))
        self.assertEqual(self.web.get("/api/v1/none")[0], 404)
        direct = json.loads(self.desk.run("mocapctl", "status", "--json", "--endpoint", control_of(self.desk.endpoint)).stdout)
        own = json.loads(self.web.get("/api/v1/status")[2])
        self.assertEqual(own["status"]["sessionId"], direct["status"]["sessionId"])
        self.assertEqual(set(own["status"]), set(direct["status"]))

    def test_a_change_happens_and_is_in_the_audit_log(self):
        status, answer = self.web.post("capture", {"action": "ACTION_STOP"})

        self.assertEqual((status, answer["code"]), (200, "CODE_DONE"))
        self.assertFalse(json.loads(self.web.get("/api/v1/status")[2])["status"]["capturing"])
        self.assertIn('method=capture params={"action":"ACTION_STOP"} answer=CODE_DONE', self.web.program.output())
        self.assertEqual(self.web.metric("mocap_web_changes_total"), 1)
        page = self.web.open_page()
        answer = page.ask(5, "capture", {"action": "ACTION_START"})
        self.assertEqual((answer["ok"], answer["result"]["code"]), (True, "CODE_DONE"))
        error = page.ask(6, "subject", {"action": "ACTION_RESET", "name": "nobody"})["error"]
        self.assertEqual(error["code"], "CODE_NOT_FOUND")
        self.assertIn("nobody", error["message"])

    def test_a_page_sees_a_skeleton(self):
        page = self.web.open_page()
        page.send({"subscribe": ["snapshot"]})
        limit = time.monotonic() + LIMIT_S
        while time.monotonic() < limit:
            snapshot = snapshot_pb2.Snapshot.FromString(page.wait_for_topic("snapshot"))
            page.send({"drawn": snapshot.number})
            if snapshot.subjects and snapshot.subjects[0].phase == snapshot_pb2.SUBJECT_PHASE_TRACKING:
                break
        self.assertEqual(snapshot.subjects[0].phase, snapshot_pb2.SUBJECT_PHASE_TRACKING)
        self.assertEqual(len(snapshot.subjects[0].bones.states), 18)

    def test_the_daemon_encodes_snapshots_only_while_a_page_wants_them(self):
        def wanted():
            return self.web.metric("mocap_feed_subscriptions")
        wait_until(lambda: wanted() == 3, "description, event and health")

        page = self.web.open_page()
        page.send({"subscribe": ["snapshot"]})
        wait_until(lambda: wanted() == 4, "the page's topic")
        page.close()

        wait_until(lambda: wanted() == 3, "the end of the page's topic")

    def test_a_page_sees_what_a_camera_sees_while_it_asks(self):
        page = self.web.open_page()
        page.send({"subscribe": ["preview/cam2"]})

        previews = [preview_pb2.Preview.FromString(page.wait_for_topic("preview/cam2")) for _ in range(3)]

        for preview in previews:
            self.assertEqual(preview.jpeg[:3], b"\xff\xd8\xff")
            self.assertEqual(jpeg_size(preview.jpeg), (-(-preview.width_px // preview.step), -(-preview.height_px // preview.step)))
            self.assertLessEqual(max(jpeg_size(preview.jpeg)), 640)
            self.assertEqual(len(preview.x_px), len(preview.y_px))
        self.assertGreater(len(previews[-1].x_px), 5)
        gaps_ns = [later.exposed_at_ns - earlier.exposed_at_ns for earlier, later in zip(previews, previews[1:], strict=False)]
        self.assertGreater(min(gaps_ns), 90e6)

    def test_a_page_sees_which_cameras_saw_a_marker_while_it_asks(self):
        page = self.web.open_page()
        page.send({"subscribe": ["snapshot", "sightings"]})
        snapshots, sightings = {}, {}

        def whole():
            """The number of a set of which both messages came, with all labels; None: not yet."""
            both = [number for number in snapshots if number in sightings and sum(subject > 0 for subject in sightings[number].subjects_plus_one) == 18]
            return both[-1] if both else None

        limit = time.monotonic() + LIMIT_S
        while whole() is None:
            self.assertLess(time.monotonic(), limit, "a set with all labels")
            topic, payload = page.wait_for(lambda message: isinstance(message, tuple))
            if topic == "sightings":
                received = sightings_pb2.Sightings.FromString(payload)
                sightings[received.number] = received
            elif topic == "snapshot":
                received = snapshot_pb2.Snapshot.FromString(payload)
                snapshots[received.number] = received
                page.send({"drawn": received.number})  # else neither comes again

        sightings = sightings[whole()]
        seen_by = {marker: bits.bit_count() for marker, bits, subject in
                   zip(sightings.markers, sightings.seen_by, sightings.subjects_plus_one, strict=True) if subject}
        cameras = snapshots[sightings.number].subjects[0].markers.cameras
        self.assertEqual([seen_by[marker] for marker in range(18)], list(cameras))
        self.assertGreater(sum(cameras), 2 * 18)
        variances = [sightings.covariances_m2[6 * i + k] for i in range(18) for k in (0, 3, 5)]
        self.assertGreater(min(variances), 0)
        self.assertLess(min(variances), 1e-6, "within a millimetre")

    @unittest.skipUnless(shutil.which("node") and FOXGLOVE_LIBRARY.exists(), "Node.js or tests/web/npm is missing: tools/setup.sh --tests")
    def test_foxgloves_own_library_reads_bones_scene_cameras_and_images(self):
        topics = ["/tf", "/scene", "/tf/cameras", "/preview/cam1"]
        client = SOURCE / "tests" / "web" / "foxglove_client.mjs"
        done = subprocess.run(["node", client, f"ws://127.0.0.1:{self.web.port}", *topics], capture_output=True, text=True, timeout=LIMIT_S)
        self.assertEqual(done.returncode, 0, done.stderr)
        received = json.loads(done.stdout)

        self.assertLess(abs(int(received["/scene"]["at_ns"]) - time.time_ns()), 60e9, "time is UTC")
        description = json.loads(self.web.get("/api/v1/description")[2])["description"]
        subject = description["subjects"][0]["name"]
        bones = {each["child_frame_id"] for each in received["/tf"]["message"]["transforms"]}
        self.assertLessEqual(bones, {f"{subject}/{bone['name']}" for bone in description["subjects"][0]["bones"]})
        cameras = {each["child_frame_id"] for each in received["/tf/cameras"]["message"]["transforms"]}
        self.assertEqual(cameras, {f"camera/{camera['name']}" for camera in description["cameras"]})
        entities = {each["id"]: each for each in received["/scene"]["message"]["entities"]}
        self.assertEqual(set(entities), {subject, "/unlabelled"})
        self.assertGreater(sum(len(each["spheres"]) for each in entities.values()), 0)
        image = received["/preview/cam1"]["message"]
        self.assertEqual((image["format"], image["frame_id"]), ("jpeg", "camera/cam1"))
        self.assertTrue(image["data"].startswith("/9j/"), "a JPEG")

    def test_the_page_has_the_findings_of_preflight(self):
        control = control_of(self.desk.endpoint)
        direct = json.loads(self.desk.run("mocapctl", "preflight", "--json", "--endpoint", control).stdout)

        status, _, text = self.web.get("/api/v1/preflight")

        self.assertEqual(status, 200)
        self.assertEqual([finding["check"] for finding in json.loads(text)], [finding["check"] for finding in direct])

    def test_a_shot_is_recorded_described_played_exported_and_downloaded(self):
        shots = {"action": "ACTION_IMPORT", "shots": [{"name": "walk 1", "slate": "walk", "notes": "slow"}]}
        self.assertEqual(self.web.post("shots", shots)[0], 200)
        self.assertEqual(self.web.post("take", {"action": "ACTION_NEXT"})[0], 200)
        wait_until(lambda: json.loads(self.web.get("/api/v1/status")[2])["status"].get("health", {}).get("take", {}).get("seconds", 0) > 1.5, "a take of 1.5 s")
        self.assertEqual(self.web.post("take", {"action": "ACTION_STOP"})[0], 200)
        listed = self.web.post("shots", {"action": "ACTION_LIST"})[1]["shots"]["shots"]
        self.assertEqual([(shot["name"], shot["done"]) for shot in listed], [("walk 1", True)])

        wait_until(lambda: self.web.get("/api/v1/takes")[0] == 200, "the folder of the takes")
        (take,) = json.loads(self.web.get("/api/v1/takes")[2])["takes"]
        self.assertEqual((take["name"], take["slate"], take["notes"], take["state"]), ("walk 1", "walk", "slow", "complete"))
        path = "/api/v1/takes/walk%201"
        self.assertEqual(json.loads(self.web.get(path)[2])["report"]["quality"]["sets"], json.loads(self.web.get(path)[2])["report"]["topics"]["snapshot"]["messages"])
        piece = self.web.get(f"{path}/snapshots?from_s=0.5&seconds=0.5")[2]
        kinds, numbers = read_piece(piece)
        self.assertEqual(kinds[0], "d")
        self.assertGreater(len(numbers), 10)
        self.assertEqual(numbers, sorted(numbers))

        status, headers, content = self.web.get("/takes/walk%201.mcap")
        self.assertEqual((status, len(content)), (200, take["bytes"]))
        self.assertIn("walk%201.mcap", headers["Content-Disposition"])
        self.assertEqual(self.web.ask("HEAD", "/takes/walk%201.mcap")[1]["Content-Length"], str(take["bytes"]))
        direct = self.desk.folder / "direct.csv"
        (self.desk.folder / "walk 1.mcap").write_bytes(content)
        self.assertEqual(self.desk.run("mocapctl", "take", "export", self.desk.folder / "walk 1.mcap", "--out", direct, "--unit", "mm").returncode, 0)
        status, _, exported = self.web.get("/takes/walk%201.csv?unit=mm")
        self.assertEqual((status, exported), (200, direct.read_bytes()))
        wish = json.loads(self.web.get(f"{path}/export?format=csv&unit=mm")[2])
        self.assertEqual((wish["state"], wish["file"]), ("done", "/takes/walk%201.csv?unit=mm"))
        status, _, answer = self.web.get("/takes/walk%201.csv?unit=mile")
        self.assertEqual(status, 422)
        self.assertIn("mile", json.loads(answer)["message"])

        self.assertEqual(self.web.ask("POST", f"{path}/edit", "{}")[0], 415)
        self.assertEqual(self.web.get(f"{path}/delete")[0], 405)
        self.assertEqual(self.web.post("takes/walk%201/edit", {"rating": 5})[0], 200)
        self.assertEqual(self.web.post("takes/walk%201/rename", {"name": "best"})[0], 200)
        self.assertEqual(json.loads(self.web.get("/api/v1/takes/best")[2])["rating"], 5)
        self.assertEqual(self.web.post("takes/best/delete", {})[0], 200)
        self.assertEqual(self.web.get("/takes/best.mcap")[0], 404)
        self.assertIn('method=/api/v1/takes/walk%201/edit params={"rating": 5} answer=', self.web.program.output())
        self.assertIn("method=/takes/walk%201.mcap params= answer=200", self.web.program.output())
        self.assertIn("method=/takes/walk%201.csv params=unit=mm answer=200", self.web.program.output())

    def test_the_daemon_may_restart(self):
        self.daemon.end()
        wait_until(lambda: self.web.get("/readyz")[0] == 503, "the loss of the daemon")
        self.assertEqual(self.web.get("/api/v1/status")[0], 503)

        self.daemon = self.desk.start("mocapd", "--config", self.desk.folder / "my.toml")

        wait_until(lambda: self.web.get("/readyz")[0] == 200, "the daemon's return")
        self.assertEqual(self.web.get("/api/v1/status")[0], 200)


class FromC3d(BesideDaemon):
    marker_set = "baseline41"  # its labels are known to the import

    def upload(self, name, content, **headers):
        headers = {"Content-Type": "application/octet-stream", **{n.replace("_", "-"): v for n, v in headers.items()}}
        status, _, text = self.web.ask("POST", f"/api/v1/subjects/import?name={name}&static=true", content, headers)
        return status, text

    def test_a_subject_is_added_from_a_c3d_file(self):
        self.assertEqual(self.web.post("take", {"action": "ACTION_START", "name": "stand"})[0], 200)
        wait_until(lambda: json.loads(self.web.get("/api/v1/status")[2])["status"].get("health", {}).get("take", {}).get("seconds", 0) > 4, "a take of 4 s")
        self.assertEqual(self.web.post("take", {"action": "ACTION_STOP"})[0], 200)
        wait_until(lambda: self.web.get("/api/v1/takes")[0] == 200, "the folder of the takes")
        status, _, c3d = self.web.get("/takes/stand.c3d")
        self.assertEqual(status, 200)
        self.assertGreater(len(c3d), 64 * 1024, "more than the body of another request may have")

        status, text = self.upload("cara", c3d)

        answer = json.loads(text)
        self.assertEqual((status, answer["code"]), (200, "CODE_DONE"), text)
        self.assertGreaterEqual(len(answer["report"]["markers"]), 4)
        direct = self.desk.folder / "direct.c3d"
        direct.write_bytes(c3d)
        own = json.loads(self.desk.run("mocapctl", "subject", "import", direct, "--name", "cara", "--static", "--out", self.desk.folder / "sets", "--json").stdout)
        for key in ("markers", "bones", "unknown", "twice", "ghosts", "residual_mm"):
            self.assertEqual(answer["report"][key], own[key], key)
        names = [marker["name"] for marker in own["markers"]]
        wait_until(lambda: [s["name"] for s in json.loads(self.web.get("/api/v1/status")[2])["status"]["subjects"]][1:] == ["cara"], "the new subject")
        described = json.loads(self.web.get("/api/v1/description")[2])["description"]["subjects"][1]
        self.assertEqual([marker["name"] for marker in described["markers"]], names)
        self.assertIn("who=", self.web.program.output())
        status, text = self.upload("cara", c3d)
        self.assertEqual(status, 400)
        self.assertIn("there is a subject 'cara' already", text.decode())
        self.assertEqual([path.name for path in (self.desk.folder / "marker_sets").iterdir()], ["cara.toml"])

    def test_a_file_that_is_no_c3d_file_gets_the_error_of_the_command(self):
        before = (self.desk.folder / "my.toml").read_text()
        for content in (b"no C3D file at all, although it is long enough" * 40, b"\x02\x50" + bytes(600), b"\x02"):
            file = self.desk.folder / "upload.c3d"
            file.write_bytes(content)
            own = self.desk.run("mocapctl", "subject", "import", file, "--name", "cara", "--out", self.desk.folder / "sets")

            status, text = self.upload("cara", content)

            self.assertEqual(status, 422, text)
            self.assertEqual(json.loads(text)["message"], own.stderr.strip().removeprefix("mocapctl: ").replace(f"{file.parent}/", ""))
        self.assertEqual(self.upload("cara", b"")[0], 400)
        self.assertEqual(self.upload("..%2Fcara", b"x")[0], 400)
        self.assertEqual(self.upload("cara", b"x", Content_Type="text/plain")[0], 415)
        self.assertEqual(self.upload("cara", b"x", Origin="http://evil.example")[0], 403)
        self.assertEqual(self.web.get("/api/v1/subjects/import")[0], 405)
        self.assertEqual((self.desk.folder / "my.toml").read_text(), before)

    def test_an_upload_is_bounded(self):
        head = "POST /api/v1/subjects/import?name=cara HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/octet-stream\r\nContent-Length: {}\r\n\r\n"
        self.assertIn(b" 413 ", read_all(self.web.raw(head.format(8 * 1024 * 1024 + 1).encode())))
        waiting = [self.web.raw(head.format(1000000).encode()) for _ in range(2)]
        wait_until(lambda: b" 503 " in read_all(self.web.raw(head.format(1000000).encode())), "two uploads are under way")
        for connection in waiting:
            connection.close()
        wait_until(lambda: self.upload("cara", b"x")[0] == 422, "places are free again")
        other = "POST /api/v1/take HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n"
        self.assertIn(b" 413 ", read_all(self.web.raw(other.format(64 * 1024 + 1).encode())))


def read_piece(piece):
    """Returns the kinds of the messages of a piece of a take, and the numbers of its snapshots."""
    kinds, numbers, at = "", [], 0
    while at < len(piece):
        size = int.from_bytes(piece[at:at + 4], "little")
        kinds += chr(piece[at + 4])
        if kinds[-1] == "s":
            numbers.append(snapshot_pb2.Snapshot.FromString(piece[at + 13:at + 4 + size]).number)
        at += 4 + size
    return kinds, numbers


def jpeg_size(data):
    """Width and height of a baseline JPEG: the segment SOF0."""
    at = 2
    while data[at + 1] != 0xC0:
        at += 2 + int.from_bytes(data[at + 2:at + 4], "big")
    return int.from_bytes(data[at + 7:at + 9], "big"), int.from_bytes(data[at + 5:at + 7], "big")


def control_of(endpoint):
    start, port = endpoint.rsplit(":", 1)
    return f"{start}:{int(port) + 1}"


if __name__ == "__main__":
    unittest.main(verbosity=2)
