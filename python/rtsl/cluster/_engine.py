"""Ray: the connection to a cluster, and the tasks that it runs."""

from __future__ import annotations

import dataclasses
import os
import socket
from typing import Any, Dict, List, Optional, Sequence, Tuple

from .._errors import Error
from . import _worker
from ._bundle import Bundle
from ._schedule import Work

#: The times that a task is tried again after its process or node died. Without a limit a scene that ends every process,
#: for want of memory say, would never end.
_RETRIES = 16
#: The most threads of a task if none are given.
_MOST_THREADS = 32
#: The seconds after which an address does not answer.
_CONNECT_SECONDS = 10.0
#: The most tasks whose ends are waited for together.
_TOGETHER = 64


def ray_module() -> Any:
    """Imports Ray. Raises an exception that says how to install it."""
    try:
        import ray
    except ImportError as error:
        raise Error(f"renders on clusters need Ray: `pip install 'rtsl[ray]'` ({error})") from None
    return ray


def connect(address: Optional[str]) -> Any:
    """Connects to a cluster, unless this process is connected already; returns the module of Ray."""
    ray = ray_module()
    if ray.is_initialized():
        return ray
    if address is not None and ":" in address:
        _check_listens(address)
    quiet: Dict[str, Any] = {"log_to_driver": False, "logging_level": "warning"}
    if address == "local":
        quiet["include_dashboard"] = False
    try:
        ray.init(address=address, **quiet)
    # Ray exits where nothing answers.
    except (ConnectionError, ValueError, RuntimeError, SystemExit) as error:
        raise Error(f"there is no cluster of Ray at `{address or 'its usual place'}`: {error}") from None
    return ray


def _check_listens(address: str) -> None:
    """Raises an exception if nothing listens at an address: Ray would try for more than a minute."""
    host, _, port = address.rpartition("//")[2].rpartition(":")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), timeout=_CONNECT_SECONDS):
            pass
    except (OSError, ValueError) as error:
        raise Error(f"there is no cluster of Ray at `{address}`: {error}") from None


@dataclasses.dataclass
class Running:
    """A task that Ray runs: the references to its report and to its sums."""

    work: Work
    report: Any
    sums: Any


class Cluster:
    """The nodes of a cluster, which render one scene."""

    def __init__(self, ray: Any, bundle: Bundle, threads: Optional[int]) -> None:
        self.ray = ray
        self.bundle = bundle
        self.threads = threads or self._usual_threads()
        self._key = bundle.key
        # References in a list are fetched only by tasks that need what they refer to.
        self._bundle = [ray.put(bundle)]
        self._files: Dict[str, Any] = {}
        self._sent = [ray.put({})]
        #: The bytes of files that were put into the store of Ray.
        self.sent_bytes = 0
        options = {"num_cpus": self.threads, "num_returns": 2, "max_retries": _RETRIES}
        self._task = ray.remote(**options)(_worker.task)

    def _processors(self) -> List[int]:
        alive = [it for it in self.ray.nodes() if it["Alive"]]
        return [int(it["Resources"].get("CPU", 0)) for it in alive]

    def _usual_threads(self) -> int:
        """The processors of the smallest node, so that a node prepares a scene once."""
        processors = [it for it in self._processors() if it > 0]
        return min(_MOST_THREADS, min(processors, default=1))

    def slots(self) -> int:
        """The number of tasks that the cluster runs at once."""
        return sum(it // self.threads for it in self._processors())

    @property
    def sent_files(self) -> int:
        """The number of files that were put into the store of Ray."""
        return len(self._files)

    def start(self, work: Work, sums: Any) -> Running:
        """Starts a task, which continues with sums, or references to them."""
        version = self.bundle.version
        arguments = (self._key, version, self._bundle, self._sent, work.chain.tiles, work.samples, sums, self.threads)
        report, of_sums = self._task.remote(*arguments)
        return Running(work, report, of_sums)

    def send(self, missing: Sequence[Any]) -> None:
        """Puts files into the store of Ray, those with the same contents once."""
        import numpy as np

        for file in missing:
            if file.digest not in self._files:
                is_empty = os.stat(file.path).st_size == 0
                contents = np.zeros(0, np.uint8) if is_empty else np.memmap(file.path, np.uint8, mode="r")
                self._files[file.digest] = self.ray.put(contents)
                self.sent_bytes += int(contents.size)
        self._sent = [self.ray.put(self._files)]

    def wait(self, running: Sequence[Running], seconds: float) -> List[Running]:
        """Returns those of the tasks that have ended, after waiting for so long at most."""
        by_report = {it.report: it for it in running}
        count = min(_TOGETHER, len(running))
        ended, _ = self.ray.wait(list(by_report), num_returns=1, timeout=seconds, fetch_local=False)
        if ended and count > 1:
            ended, _ = self.ray.wait(list(by_report), num_returns=count, timeout=0, fetch_local=False)
        return [by_report[it] for it in ended]

    def result(self, ended: Running) -> Optional[Tuple[Any, Any]]:
        """Returns the report and the sums of a task that has ended; ``None`` if Ray lost them for good.

        Errors of the scene are raised as they were in the node.
        """
        exceptions = self.ray.exceptions
        try:
            report, sums = self.ray.get([ended.report, ended.sums])
        except exceptions.RayTaskError as error:
            if "No module named 'rtsl'" in str(error):
                raise Error(
                    "a node of the cluster has no package `rtsl`: install the version of the head, "
                    f"{self.bundle.version}, for its Python"
                ) from None
            if isinstance(error.cause, exceptions.ObjectLostError):
                return None
            if isinstance(error.cause, Error):
                raise error.cause from None
            raise
        except exceptions.ObjectLostError:
            return None
        except (exceptions.WorkerCrashedError, exceptions.NodeDiedError, exceptions.OutOfMemoryError) as error:
            reason = "the scene is at fault, or nodes have too little memory"
            raise Error(f"a task ended its process {_RETRIES + 1} times, so {reason}: {error}") from None
        return report, sums

    def cancel(self, running: Sequence[Running]) -> None:
        """Ends tasks."""
        for task in running:
            self.ray.cancel(task.report)
