"""Channels to a coordinator, and messages of jobs, for programs that call its gRPC API themselves.

Needs the packages of `osteon[grpc]`. Messages and stubs are in :mod:`osteon.v1`; no `.proto` file has to be
compiled:

    >>> import osteon
    >>> from osteon import rpc
    >>> from osteon.v1.jobs_pb2 import SubmitRequest
    >>> job = osteon.Job.read("examples/fast.toml")
    >>> request = SubmitRequest(specification=rpc.specification(job), request_id="fast, 1")
    >>> request.specification.monte_carlo.realizations
    1024

:class:`osteon.Client` needs none of this. It adds retries, and writes the files of a result.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from osteon._jobs import Job, Kind
from osteon._states import Credentials
from osteon.errors import UnreadableFileError, refuse

try:
    import grpc
    import grpc.aio

    from osteon.v1 import jobs_pb2_grpc, specification_pb2
except ImportError as error:
    raise ImportError(
        f"osteon.rpc needs the packages of osteon[grpc] (grpcio, protobuf): {error}"
    ) from error

MESSAGE_MAX = 64 << 20
"""Longest message of the API, bytes."""

KEEPALIVE_MS = 20_000
"""Time without a message after which a client asks whether the coordinator is there."""

OPTIONS: tuple[tuple[str, str | int], ...] = (
    ("grpc.max_receive_message_length", MESSAGE_MAX),
    ("grpc.max_send_message_length", MESSAGE_MAX),
    ("grpc.keepalive_time_ms", KEEPALIVE_MS),
    ("grpc.keepalive_timeout_ms", 10_000),
)


def specification(
    job: Job, *, kind: Kind | None = None
) -> specification_pb2.JobSpecification:
    """A job as a message, with every default and all data.

    Args:
        job: the job.
        kind: by default an identification if the job has data.
    """
    return specification_pb2.JobSpecification.FromString(job.to_message(kind))


def jobs(
    coordinator: str, credentials: Credentials | None = None
) -> tuple[jobs_pb2_grpc.JobsStub, grpc.Channel]:
    """The stub of a coordinator's API for clients, and its channel, which the caller closes.

    Nothing is connected before the first call.

    Args:
        coordinator: `https://HOST:PORT`, `http://HOST:PORT` or `unix:PATH`.
        credentials: certificates and token. A token is sent over TLS, or to this machine only.
    """
    target, secret = resolved(coordinator, credentials or Credentials())
    if secret is None:
        channel = grpc.insecure_channel(target, options(target))
    else:
        channel = grpc.secure_channel(target, secret, options(target))
    return jobs_pb2_grpc.JobsStub(channel), channel


def jobs_async(
    coordinator: str, credentials: Credentials | None = None
) -> tuple[jobs_pb2_grpc.JobsAsyncStub, grpc.aio.Channel]:
    """The same as :func:`jobs`, for `asyncio`."""
    target, secret = resolved(coordinator, credentials or Credentials())
    if secret is None:
        channel = grpc.aio.insecure_channel(target, options(target))
    else:
        channel = grpc.aio.secure_channel(target, secret, options(target))
    return jobs_pb2_grpc.JobsStub(channel), channel


def options(target: str) -> tuple[tuple[str, str | int], ...]:
    """The options of a channel."""
    # The name of the server would be the path of the socket, which is none.
    return (*OPTIONS, ("grpc.default_authority", "localhost")) if target.startswith("unix:") else OPTIONS


def resolved(
    coordinator: str, credentials: Credentials
) -> tuple[str, grpc.ChannelCredentials | None]:
    """The target of a channel and its credentials; None for one that is neither safe nor local."""
    if coordinator.startswith("unix:"):
        return coordinator, local(grpc.LocalConnectionType.UDS, credentials)
    try:
        url = urlsplit(coordinator)
        port = url.port
    except ValueError as error:
        refuse("coordinator", f"is {coordinator!r}: {error}")
    if url.scheme not in ("http", "https") or url.hostname is None or port is None:
        allowed = "it must be https://HOST:PORT, http://HOST:PORT or unix:PATH"
        refuse("coordinator", f"is {coordinator!r}; {allowed}")
    target = f"[{url.hostname}]:{port}" if ":" in url.hostname else f"{url.hostname}:{port}"
    if url.scheme == "https":
        secret = grpc.ssl_channel_credentials(
            root_certificates=content(credentials.tls_ca, "tls_ca"),
            private_key=content(credentials.tls_key, "tls_key"),
            certificate_chain=content(credentials.tls_cert, "tls_cert"),
        )
        return target, with_token(secret, credentials)
    if credentials.token_file is None:
        return target, None
    if url.hostname not in ("127.0.0.1", "::1", "localhost"):
        refuse("coordinator", f"is {coordinator!r}; a token is sent over https, or to this machine only")
    return target, local(grpc.LocalConnectionType.LOCAL_TCP, credentials)


def local(kind: grpc.LocalConnectionType, credentials: Credentials) -> grpc.ChannelCredentials:
    """Credentials of a connection that does not leave this machine."""
    return with_token(grpc.local_channel_credentials(kind), credentials)


def with_token(secret: grpc.ChannelCredentials, credentials: Credentials) -> grpc.ChannelCredentials:
    """Credentials that show the token, if there is one, with every call."""
    token = content(credentials.token_file, "token_file")
    if token is None:
        return secret
    try:
        text = token.decode("ascii").strip()
    except UnicodeDecodeError:
        refuse("credentials.token_file", f"{credentials.token_file} has no token: it is no ASCII text")
    return grpc.composite_channel_credentials(secret, grpc.access_token_call_credentials(text))


def content(path: Any, field: str) -> bytes | None:
    """The content of a file of the credentials."""
    if path is None:
        return None
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise UnreadableFileError(f"credentials.{field}: cannot read {path}: {error}") from error
