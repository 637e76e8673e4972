"""The device host: a process that holds devices in real time, and the agent's side of it.

`host` is what runs there, by itself or with what `devices` describes; `client` is the plant that
the agent sees. Between them are the shared memory of `memory` and the messages of `wire`.
"""
