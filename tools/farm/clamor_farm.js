// clamor_farm.js: a job type of Flamenco: a task for each line that `clamor farm` prints, and the merge
// after them. Put it into the folder `scripts` of Flamenco's Manager.

const JOB_TYPE = {
  label: "Clamor farm",
  settings: [
    {key: "lines", type: "string", required: true, description: "What clamor farm prints"},
    {key: "merge", type: "string", required: true, description: "As in: clamor farm merge /farm/room.clamor"},
  ],
};

function compileJob(job) {
  const taskOf = (name, line) => {
    const task = author.Task(name, "misc");
    task.addCommand(author.Command("exec", {exe: "sh", args: ["-c", line]}));
    return task;
  };
  const shards = job.settings.lines.split("\n").filter((line) => line !== "")
    .map((line, i) => taskOf(`shard-${i + 1}`, line));
  const merge = taskOf("merge", job.settings.merge);
  for (const shard of shards) {
    job.addTask(shard);
    merge.addDependency(shard);
  }
  job.addTask(merge);
}
