"""The verification suite: tissue mechanics against closed forms, published figures, invariants and another engine."""
