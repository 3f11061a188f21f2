"""Links: how bytes come and go. A listener runs until it is cancelled and opens its link again whenever it breaks."""
