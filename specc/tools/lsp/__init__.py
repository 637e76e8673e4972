"""The language server of specifications: the only door to pygls and lsprotocol.

`project` analyses texts, `index` knows their symbols, `features` answers in offsets, `session` in
the terms of the protocol. `server` speaks with the client; a `worker` does what may take long.
"""
