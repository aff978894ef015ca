import sys, zmq
from mocap.v1 import description_pb2, snapshot_pb2
feed = zmq.Context.instance().socket(zmq.SUB)
feed.connect(sys.argv[1] if len(sys.argv) > 1 else "tcp://127.0.0.1:5570")
for topic in (b"description\0", b"snapshot\0"): feed.subscribe(topic)
while True:
    topic, _, payload = feed.recv().partition(b"\0")
    if topic == b"description":
        names = [[m.name for m in s.markers] for s in description_pb2.Description.FromString(payload).subjects]
    else:
        for s in snapshot_pb2.Snapshot.FromString(payload).subjects:
            at = s.markers.positions_m
            print({n: tuple(at[3 * i:3 * i + 3]) for i, n in enumerate(names[s.subject]) if s.markers.states[i] != 1}, flush=True)
