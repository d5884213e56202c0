"""What outlives the gate: a STOP that stands, who was driven, whose a robot is."""
