"""What the client's tests share: a synthetic character, a small broker, a server that answers."""
