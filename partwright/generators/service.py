"""A generator that is an HTTP service: JSON with the picture goes there, a GLB comes back.

The contract is that of Hunyuan3D's own server: POST `{"image": "<base64 of the file>"}`, answered by the GLB.
"""

from __future__ import annotations

import base64
import http.client
import json
import re
import threading
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from partwright.errors import GeneratorError, SettingError
from partwright.generators.deadline import POLL, Deadline
from partwright.generators.glb import quoted

LARGEST = 1 << 30  # bytes of an answer
_CHUNK = 1 << 16


def is_address(via: str) -> bool:
    """Whether it is an address, of whatever kind, and no command."""
    return re.match(r"\s*[A-Za-z][A-Za-z0-9+.-]*://", via) is not None


@dataclass(frozen=True)
class Service:
    """Where a service is."""

    scheme: str
    host: str
    port: int | None
    target: str

    @classmethod
    def of(cls, address: str) -> Service:
        """Of an address.

        Raises:
            SettingError: it is none that can be asked.
        """
        try:
            parts = urlsplit(address.strip())
            host, port = parts.hostname, parts.port
        except ValueError as error:
            raise SettingError(f"via: {address!r} is no address ({error})") from error
        if parts.scheme.lower() not in ("http", "https") or not host or parts.username is not None:
            raise SettingError(
                f"via: expected an address as http://localhost:8081/generate, without a password, "
                f"got {address!r}"
            )
        target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        if re.search(r"[\x00-\x20\x7f]|[^\x00-\x7f]", target):
            raise SettingError(f"via: {address!r} holds characters that an address must write as %XX")
        return cls(parts.scheme.lower(), host, port, target)

    @property
    def name(self) -> str:
        return f"the service at {self.host}" + (f":{self.port}" if self.port else "")

    def mesh_of(self, image: Path, deadline: Deadline) -> bytes:
        """What it answered.

        The request runs in a thread of its own, so that whatever it waits for, the deadline is kept.

        Raises:
            GeneratorError: it cannot be reached, refuses, took too long, or its answer is cut.
            CancelledError: it was cancelled.
        """
        picture = image.read_bytes()
        body = json.dumps({"image": base64.b64encode(picture).decode("ascii")}).encode()
        kind = http.client.HTTPSConnection if self.scheme == "https" else http.client.HTTPConnection
        connection = kind(self.host, self.port, timeout=deadline.seconds + 1)
        asking = _Asking(connection, self, body)
        asking.start()
        while asking.is_alive():
            deadline.check(self.name)
            asking.join(POLL)
        if asking.error is not None:
            raise asking.error
        return asking.answer


class _Asking(threading.Thread):
    """One request. It does not keep the process from ending, and what it gets too late is dropped."""

    def __init__(self, connection: http.client.HTTPConnection, service: Service, body: bytes) -> None:
        super().__init__(daemon=True, name="generator")
        self._connection, self._service, self._body = connection, service, body
        self.answer = b""
        self.error: GeneratorError | None = None

    def run(self) -> None:
        name = self._service.name
        try:
            self.answer = self._ask()
        except GeneratorError as error:
            self.error = error
        except (OSError, http.client.HTTPException) as error:
            reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
            self.error = GeneratorError(f"{name} cannot be asked: {reason}; is it running?")
        finally:
            self._connection.close()

    def _ask(self) -> bytes:
        headers = {
            "Content-Type": "application/json",
            "Accept": "model/gltf-binary, application/octet-stream",
        }
        self._connection.request("POST", self._service.target, self._body, headers)
        response = self._connection.getresponse()
        if response.status != 200:
            elsewhere = response.getheader("Location")
            said = f"it sends to {quoted(elsewhere.encode())}" if elsewhere else quoted(response.read(_CHUNK))
            raise GeneratorError(
                f"{self._service.name} answered {response.status} {response.reason}"
                + (f": {said}" if said else "")
            )
        data = bytearray()
        while chunk := response.read(_CHUNK):
            data += chunk
            if len(data) > LARGEST:
                raise GeneratorError(f"{self._service.name} answered with more than {LARGEST >> 20} MiB")
        if response.length:  # what is left of the length that it promised
            raise GeneratorError(f"{self._service.name} broke off, {response.length} bytes before the end")
        return bytes(data)
