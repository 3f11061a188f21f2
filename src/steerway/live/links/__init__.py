"""Links: how bytes come and go, one kind of link a file. A link runs until cancelled and reopens whenever it breaks."""
