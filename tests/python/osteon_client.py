"""A client of osteon in Python, made from its .proto files. docs/grpc.md explains it."""

import array
import json
import time

import grpc
from google.rpc import error_details_pb2
from grpc_status import rpc_status

from osteon.v1 import jobs_pb2, specification_pb2


def connect(address, ca_file, token_file):
    """A channel over TLS to `HOST:PORT` that shows the token with every call."""
    with open(ca_file, "rb") as file:
        tls = grpc.ssl_channel_credentials(root_certificates=file.read())
    with open(token_file, encoding="ascii") as file:
        token = grpc.access_token_call_credentials(file.read().strip())
    return grpc.secure_channel(address, grpc.composite_channel_credentials(tls, token))


def propagation(realizations, seed):
    """The velocity of a random bone: its moments over so many realizations."""

    def fixed(value):
        return specification_pb2.ParameterRange(fixed=value)

    return specification_pb2.JobSpecification(
        kind=specification_pb2.JOB_KIND_PROPAGATION,
        parameters=specification_pb2.Parameters(
            density=fixed(1598.8),
            longitudinal_young_modulus=fixed(17.717e9),
            longitudinal_poisson_ratio=fixed(0.3816),
            longitudinal_shear_modulus=fixed(4.795e9),
            transverse_young_modulus=fixed(9.8254e9),
            transverse_poisson_ratio=fixed(0.4495),
            dispersion=fixed(0.1029),
        ),
        monte_carlo=specification_pb2.MonteCarlo(realizations=realizations, seed=seed),
    )


def identification(groups, realizations, seed):
    """Stiffness along the bone and dispersion of each group of velocities, m/s, by its name."""

    def fixed(value):
        return specification_pb2.ParameterRange(fixed=value)

    def free(start, lower, upper):
        between = specification_pb2.FreeRange(start=start, lower=lower, upper=upper)
        return specification_pb2.ParameterRange(free=between)

    return specification_pb2.JobSpecification(
        kind=specification_pb2.JOB_KIND_IDENTIFICATION,
        data=specification_pb2.Data(
            groups=[
                specification_pb2.VelocityGroup(name=name, velocities=velocities)
                for name, velocities in groups.items()
            ]
        ),
        parameters=specification_pb2.Parameters(
            density=fixed(1598.8),
            longitudinal_young_modulus=free(18e9, lower=12e9, upper=25e9),
            longitudinal_poisson_ratio=fixed(0.3816),
            longitudinal_shear_modulus=fixed(4.795e9),
            transverse_young_modulus=fixed(9.8254e9),
            transverse_poisson_ratio=fixed(0.4495),
            dispersion=free(0.1, lower=0.02, upper=0.3),
        ),
        monte_carlo=specification_pb2.MonteCarlo(realizations=realizations, seed=seed),
        search=specification_pb2.Search(method=specification_pb2.SEARCH_METHOD_NEWTON),
    )


def submit(jobs, specification, request_id):
    """Submits a job; its identifier. The same `request_id` again gives the same job."""
    request = jobs_pb2.SubmitRequest(specification=specification, request_id=request_id)
    return jobs.Submit(request, timeout=30).job


def watch(jobs, job, show, patience=10.0):
    """Shows each snapshot of a job once until it has ended; the last one. A stream that breaks is
    taken up again after the last snapshot that was seen, for `patience` seconds."""
    last, seen, heard = None, 0, time.monotonic()
    while True:
        try:
            for response in jobs.Watch(jobs_pb2.WatchRequest(job=job, after=seen)):
                last, heard = response.snapshot, time.monotonic()
                seen = last.sequence
                show(last)
            return last
        except grpc.RpcError as error:
            gone = error.code() == grpc.StatusCode.UNAVAILABLE
            if not gone or time.monotonic() - heard > patience:
                raise
            time.sleep(0.25)


def fetch(jobs, job):
    """The result of an ended job, as in `result.json`, and the velocities at the best points, m/s, NaN
    on failure: by the number of the group, None where there are no groups."""
    result, groups, velocities = None, [], {}
    for response in jobs.Fetch(jobs_pb2.FetchRequest(job=job)):
        part = response.WhichOneof("part")
        if part == "result":
            result = json.loads(response.result.json)
        elif part == "group":
            groups.append(json.loads(response.group.json))
        elif part == "realizations":
            block = response.realizations
            group = block.group if block.HasField("group") else None
            of_point = velocities.setdefault(group, array.array("d"))
            for code, velocity in zip(block.codes, block.velocities):
                of_point.append(velocity if code == 0 else float("nan"))
    if groups:
        result["groups"] = groups
    return result, velocities


def every_job(jobs, page_size=100):
    """Snapshots of all jobs, oldest first."""
    request = jobs_pb2.ListRequest(page_size=page_size)
    while True:
        page = jobs.List(request, timeout=30)
        yield from page.jobs
        if not page.next_page_token:
            return
        request.page_token = page.next_page_token


def details(error, kind):
    """The first of a refusal's details that is a `kind` of google.rpc, or None."""
    status = rpc_status.from_call(error)
    for detail in status.details if status else []:
        found = kind()
        if detail.Unpack(found):
            return found
    return None


def violations(error):
    """What is wrong with a refused request: the message of each field, by its path."""
    bad_request = details(error, error_details_pb2.BadRequest)
    fields = bad_request.field_violations if bad_request else []
    return {violation.field: violation.description for violation in fields}
