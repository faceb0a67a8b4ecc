"""A crowd for a coordinator, over gRPC: thousands of jobs, and workers that hold what they are sent and compute
nothing."""

import asyncio
import re
import subprocess
import sys
import threading

import looking

SLOTS, HOSTS = 4, 40
# Submissions and workers on one connection.
AT_ONCE, WORKERS_OF_CHANNEL = 64, 100


def messages(work):
    """Compiles the .proto files, and returns the modules of messages and calls."""
    made, protos = work / "messages", looking.ROOT / "proto"
    made.mkdir(exist_ok=True)
    files = sorted(path.relative_to(protos) for path in protos.glob("osteon/v1/*.proto"))
    subprocess.run([sys.executable, "-m", "grpc_tools.protoc", f"-I{protos}", f"--python_out={made}",
                    f"--grpc_python_out={made}", *map(str, files)], check=True, cwd=protos)
    sys.path.insert(0, str(made))
    from osteon.v1 import jobs_pb2, jobs_pb2_grpc, specification_pb2, workers_pb2, workers_pb2_grpc

    return jobs_pb2, jobs_pb2_grpc, specification_pb2, workers_pb2, workers_pb2_grpc


class Crowd:
    """Workers that stay attached until `leave`."""

    def __init__(self, osteon, address, work):
        import grpc

        self.grpc, self.address = grpc, address
        self.jobs, self.jobs_calls, self.specification, self.workers, self.workers_calls = messages(work)
        version, numerics = re.match(
            r"osteon (\S+).*numerics (\d+)", subprocess.run(
                [osteon, "--version"], check=True, capture_output=True, text=True).stdout).groups()
        self.version, self.fingerprint = version, f"osteon {version} numerics {numerics}"
        self.loop = asyncio.new_event_loop()
        threading.Thread(target=self.loop.run_forever, daemon=True).start()
        self.streams = []

    def do(self, what):
        return asyncio.run_coroutine_threadsafe(what, self.loop).result(300)

    def submit(self, count):
        """Submits so many small jobs."""
        self.do(self._submit(count))

    async def _submit(self, count):
        spec = self.specification
        wanted = spec.JobSpecification(kind=spec.JOB_KIND_PROPAGATION)
        wanted.monte_carlo.realizations = 8
        for name, value in (("density", 1598.8), ("longitudinal_young_modulus", 17.717e9),
                            ("longitudinal_poisson_ratio", 0.3816), ("longitudinal_shear_modulus", 4.795e9),
                            ("transverse_young_modulus", 9.8254e9), ("transverse_poisson_ratio", 0.4495),
                            ("dispersion", 0.1029)):
            getattr(wanted.parameters, name).fixed = value
        async with self.grpc.aio.insecure_channel(self.address) as channel:
            calls, turn = self.jobs_calls.JobsStub(channel), asyncio.Semaphore(AT_ONCE)

            async def one(number):
                async with turn:
                    request = self.jobs.SubmitRequest(
                        specification=wanted, name=f"patient {number}", client=f"lab {number % 7}")
                    await calls.Submit(request, timeout=120)

            await asyncio.gather(*map(one, range(count)))

    def attach(self, count):
        """Attaches so many workers."""
        self.do(self._attach(count))

    async def _attach(self, count):
        for number in range(count):
            if number % WORKERS_OF_CHANNEL == 0:
                # Without an option of its own each channel would share one connection.
                options = [("grpc.use_local_subchannel_pool", 1)]
                channel = self.grpc.aio.insecure_channel(self.address, options=options)
            stream = self.workers_calls.WorkersStub(channel).Attach()
            hello = self.workers.WorkerHello(
                version=self.version, fingerprint=self.fingerprint, slots=SLOTS,
                host=f"node-{number % HOSTS:02}", process=number + 1, instance=number + 1)
            await stream.write(self.workers.AttachRequest(hello=hello))
            welcome = (await stream.read()).welcome
            task = asyncio.ensure_future(self._live(stream, welcome.heartbeat_s))
            self.streams.append((channel, stream, task))

    async def _live(self, stream, heartbeat):
        async def read():
            while await stream.read() is not self.grpc.aio.EOF:
                pass

        reading = asyncio.ensure_future(read())
        while not reading.done():
            await stream.write(self.workers.AttachRequest(heartbeat=self.workers.Heartbeat()))
            await asyncio.wait([reading], timeout=heartbeat)

    def leave(self):
        async def end():
            for _, stream, task in self.streams:
                task.cancel()
                stream.cancel()
            for channel in {id(channel): channel for channel, *_ in self.streams}.values():
                await channel.close()

        self.do(end())
        self.loop.call_soon_threadsafe(self.loop.stop)
