"""What every part of live shares: rows, orders, addresses, the receiver's clock."""
