"""The language server of specifications: the only door to pygls and lsprotocol.

`project` analyses texts, `index` knows their symbols, `features` answers in offsets, `session` in
the terms of the protocol. `server` speaks with the client, and has a `worker` do what may take long.
"""
