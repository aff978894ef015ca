import zmq, mocap.v1.description_pb2 as description, mocap.v1.snapshot_pb2 as snapshot
feed = zmq.Context().socket(zmq.SUB)
feed.connect("tcp://127.0.0.1:5570")
feed.subscribe("")
while True:
    topic, message = feed.recv().split(b"\0", 1)
    if topic == b"description":  # a new subscriber receives the description first
        names = [marker.name for marker in description.Description.FromString(message).subjects[0].markers]
    elif topic == b"snapshot" and (at := snapshot.Snapshot.FromString(message).subjects[0].markers.positions_m):
        print({name: at[3 * i : 3 * i + 3] for i, name in enumerate(names) if any(at[3 * i : 3 * i + 3])}, flush=True)
