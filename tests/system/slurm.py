"""A Slurm cluster of two machines with one processor each, all of them processes of this machine."""

import os
import pathlib
import shutil
import socket
import subprocess

from harness import until

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "sinfo", "scancel")

CONFIG = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort=16817
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
CryptoType=crypto/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SlurmdParameters=config_overrides
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
KillWait=5
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port=17001 CPUs=1
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port=17002 CPUs=1
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
"""


def missing():
    """The programs that are not installed."""
    path = os.environ["PATH"] + ":/usr/sbin"
    return [program for program in PROGRAMS if shutil.which(program, path=path) is None]


class Cluster:
    """Runs from `begin` until `end`. Programs that are given `environment` submit to it. The folder is new, and its path has no
    spaces: slurm.conf cannot name one."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self._processes = []
        for name in ("munge", "state", "n1", "n2"):
            (self.folder / name).mkdir(parents=True, mode=0o700)
        self.environment = os.environ | {"SLURM_CONF": str(self.folder / "slurm.conf"), "PATH": os.environ["PATH"] + ":/usr/sbin"}
        host = socket.gethostname().split(".")[0]
        (self.folder / "slurm.conf").write_text(CONFIG.format(host=host, folder=self.folder))

    def begin(self):
        self._add_address()
        self._start_munge()
        self._start("slurmctld", "-D")
        for node in ("n1", "n2"):
            self._start("slurmd", "-D", "-N", node)
        until(lambda: self.run("sinfo", "-h", "-o", "%D %T") == "2 idle", "both machines of the cluster are idle")

    @staticmethod
    def _add_address():
        """Slurm looks names up with AI_ADDRCONFIG, which finds nothing on a machine that has only the loopback."""
        for command in ("link add farm0 type veth peer name farm1", "addr add 10.9.0.1/24 dev farm0", "link set farm0 up"):
            subprocess.run(["ip", *command.split()], check=True, capture_output=True)

    def _start_munge(self):
        munge = self.folder / "munge"
        (munge / "key").write_bytes(os.urandom(1024))
        (munge / "key").chmod(0o400)
        self._start("munged", "--foreground", "--force", f"--key-file={munge}/key", f"--socket={munge}/socket",
                    f"--pid-file={munge}/pid", f"--log-file={munge}/log", f"--seed-file={munge}/seed")
        until((munge / "socket").exists, "munge has its socket")

    def _start(self, *command):
        log = open(self.folder / f"{command[0]}.{len(self._processes)}.out", "wb")
        self._processes.append(subprocess.Popen(command, env=self.environment, stdout=log, stderr=log))
        log.close()

    def run(self, *command):
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=60)
        return done.stdout.strip()

    def end(self):
        self.run("scancel", "--user=root")
        for process in reversed(self._processes):
            process.terminate()
        for process in self._processes:
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
