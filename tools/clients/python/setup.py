"""Adds the Python code of the messages (mocap/v1/*_pb2.py) to the package; protoc generates the code from proto/."""

import pathlib
import subprocess

from setuptools import setup
from setuptools.command.build_py import build_py

PROTO = pathlib.Path(__file__).resolve().parents[3] / "proto"


class BuildWithMessages(build_py):
    def run(self):
        super().run()
        messages = sorted(PROTO.glob("mocap/v1/*.proto"))
        if not messages:
            raise SystemExit(f"{PROTO}: no mocap/v1/*.proto found; install from a complete clone of the project")
        subprocess.run(["protoc", f"--proto_path={PROTO}", f"--python_out={self.build_lib}", *map(str, messages)], check=True)


setup(cmdclass={"build_py": BuildWithMessages})
