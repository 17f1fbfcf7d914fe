"""What is judged of a result, topic by topic: findings, which the verdict puts in order."""
