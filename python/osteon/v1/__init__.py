"""The gRPC API of a coordinator: messages and stubs, made from the `.proto` files of the repository.

They need the packages of `osteon[grpc]`. :mod:`osteon.rpc` opens channels for them; docs/grpc.md explains
the calls.
"""
