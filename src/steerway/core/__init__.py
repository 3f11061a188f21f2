"""What every other room stands on: records, angles, the earth, checks, compilation."""
