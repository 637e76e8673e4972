"""The language server of specifications: the only door to pygls and lsprotocol.

`project` analyses texts, `index` knows the symbols, `server` speaks the protocol; only the last
imports pygls. `desk` does what may take long, in the process of a `worker` that can be ended.
"""
