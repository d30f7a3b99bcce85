// SPDX-License-Identifier: Apache-2.0
// --shard: what is typed, what the starters of many processes set, and who does what.
#include "player/options/shard.h"

#include <gsc/error.h>
#include "runtime/records/shard_facts.h"
#include "player/sweep/sweep_config.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <string>

using namespace gsc;

namespace {

using Variables = std::map<std::string, std::string>;

// "2/4", or what the message says.
std::string shardText(const std::string& typed, const Variables& variables = {}, bool ranks_are_devices = false)
{
    const auto environment = [&](const char* name) {
        const auto found = variables.find(name);
        return found == variables.end() ? nullptr : found->second.c_str();
    };
    try {
        return parseShard(typed, "--shard", environment, ranks_are_devices).text();
    } catch (const Error& e) {
        CHECK(e.code() == ErrorCode::Usage);
        return e.what();
    }
}

bool says(const std::string& message, const char* part)
{
    return message.find(part) != std::string::npos && message.find(", expected ") != std::string::npos &&
           message.find("; ") != std::string::npos;
}

Variables slurmArray(const char* id, const char* count, const char* first, const char* last, const char* step)
{
    Variables variables = {{"SLURM_ARRAY_TASK_ID", id}, {"SLURM_ARRAY_TASK_COUNT", count}};
    if (*first != 0)
        variables["SLURM_ARRAY_TASK_MIN"] = first;
    if (*last != 0)
        variables["SLURM_ARRAY_TASK_MAX"] = last;
    if (*step != 0)
        variables["SLURM_ARRAY_TASK_STEP"] = step;
    return variables;
}

} // namespace

TEST_CASE("a shard that is typed")
{
    for (const char* good : {"1/1", "1/4", "4/4", "1000000/1000000"})
        CHECK(shardText(good) == good);
    CHECK(shardText("02/04") == "2/4");
    for (const char* bad :
         {"",      "/",      "1",      "1/",   "/4",          "0/4", "5/4", "1/0",   "1/1000001",
          "-1/4",  "1/-4",   "1 /4",   "1/4 ", "1/4/4",       "a/4", "1/b", "1.5/4", "18446744073709551617/4",
          "auto/", "auto/0", "auto/x", "Auto", "auto/1000001"})
        CHECK_MESSAGE(says(shardText(bad), "no part of a whole"), bad);
}

TEST_CASE("a shard of a Slurm array")
{
    CHECK(shardText("auto", slurmArray("1", "4", "1", "4", "1")) == "1/4");
    CHECK(shardText("auto", slurmArray("4", "4", "1", "4", "1")) == "4/4");
    CHECK(shardText("auto", slurmArray("0", "4", "", "", "")) == "1/4");
    CHECK(shardText("auto", slurmArray("0", "4", "0", "3", "")) == "1/4");
    CHECK(shardText("auto", slurmArray("8", "5", "0", "8", "2")) == "5/5");
    CHECK(shardText("auto/4", slurmArray("3", "4", "1", "4", "1")) == "3/4");
    // --array=1,3,7 has gaps; so has a number before the first, and one between two steps
    CHECK(says(shardText("auto", slurmArray("3", "3", "1", "7", "1")), "without gaps"));
    CHECK(says(shardText("auto", slurmArray("0", "3", "1", "3", "1")), "without gaps"));
    CHECK(says(shardText("auto", slurmArray("3", "5", "0", "8", "2")), "without gaps"));
    CHECK(says(shardText("auto", slurmArray("5", "4", "", "", "")), "without gaps"));
    // one task of four, submitted again by itself, would do the whole
    CHECK(shardText("auto", slurmArray("3", "1", "3", "3", "1")) == "1/1");
    CHECK(says(shardText("auto/4", slurmArray("3", "1", "3", "3", "1")), "is one of 1, expected one of 4"));
    CHECK(says(shardText("auto", {{"SLURM_ARRAY_TASK_ID", "3"}}), "SLURM_ARRAY_TASK_COUNT is not"));
    CHECK(says(shardText("auto", slurmArray("x", "4", "", "", "")), "SLURM_ARRAY_TASK_ID: is \"x\""));
    CHECK(says(shardText("auto", {{"SLURM_PROCID", "1"}, {"SLURM_NTASKS", "4"}}), "none of"));
}

TEST_CASE("a shard of Open MPI and of Kubernetes")
{
    const Variables mpi = {{"OMPI_COMM_WORLD_RANK", "0"}, {"OMPI_COMM_WORLD_SIZE", "3"}};
    CHECK(shardText("auto", mpi) == "1/3");
    CHECK(shardText("auto/3", mpi) == "1/3");
    CHECK(says(shardText("auto/4", mpi), "is one of 3, expected one of 4"));
    CHECK(says(shardText("auto", {{"OMPI_COMM_WORLD_RANK", "3"}, {"OMPI_COMM_WORLD_SIZE", "3"}}), "number 3 of 3"));
    CHECK(says(shardText("auto", {{"OMPI_COMM_WORLD_RANK", "3"}}), "none of"));
    const Variables job = {{"JOB_COMPLETION_INDEX", "2"}};
    CHECK(shardText("auto/3", job) == "3/3");
    CHECK(says(shardText("auto", job), "pass --shard auto/N"));
    CHECK(says(shardText("auto/2", job), "number 2 of 2"));
    CHECK(says(shardText("auto/2"), "JOB_COMPLETION_INDEX (Kubernetes)"));
    CHECK(says(shardText("auto"), "SLURM_ARRAY_TASK_ID"));
    CHECK(says(shardText("auto", {{"PARALLEL_JOBSLOT", "2"}, {"PARALLEL_SEQ", "7"}}), "none of")); // a slot does many
    CHECK(says(shardText("auto", {{"SLURM_ARRAY_TASK_ID", ""}}), "none of"));
    Variables both = mpi;
    both.insert({{"SLURM_ARRAY_TASK_ID", "1"}, {"SLURM_ARRAY_TASK_COUNT", "2"}});
    CHECK(says(shardText("auto", both), "both SLURM_ARRAY_TASK_ID and OMPI_COMM_WORLD_RANK"));
}

TEST_CASE("ranks that are devices of one run are no shards")
{
    Variables variables = {{"OMPI_COMM_WORLD_RANK", "0"}, {"OMPI_COMM_WORLD_SIZE", "2"}};
    for (const char* typed : {"auto", "auto/2"})
        for (const Variables& set : {variables, Variables{}}) {
            CHECK(says(shardText(typed, set, true), "devices of one run"));
            CHECK(says(shardText(typed, set, true), "pass --shard I/N"));
        }
    CHECK(shardText("2/2", variables, true) == "2/2");
    variables["JOB_COMPLETION_INDEX"] = "2";
    CHECK(shardText("auto/3", variables, true) == "3/3");
    CHECK(says(shardText("auto", variables, true), "pass --shard auto/N"));
    variables.erase("JOB_COMPLETION_INDEX");
    variables.merge(slurmArray("4", "4", "1", "4", "1"));
    CHECK(shardText("auto", variables, true) == "4/4"); // each task of the array is an MPI job
}

TEST_CASE("each task is done by one shard, and all do about as many")
{
    for (uint64_t count = 1; count < 12; ++count)
        for (uint64_t tasks = 0; tasks < 40; ++tasks) {
            std::vector<uint64_t> turns(count, 0), blocks(count, 0);
            for (uint64_t task = 0; task < tasks; ++task) {
                uint64_t takers = 0;
                for (uint64_t index = 1; index <= count; ++index)
                    if (takesTask({index, count}, task)) {
                        ++takers;
                        ++turns[index - 1];
                    }
                CHECK(takers == 1);
            }
            const std::vector<uint64_t> shards = blockShards(std::vector<uint64_t>(tasks, 7), count);
            CHECK(std::ranges::is_sorted(shards));
            for (const uint64_t shard : shards)
                ++blocks.at(shard);
            CHECK(*std::ranges::max_element(turns) - *std::ranges::min_element(turns) <= 1);
            CHECK(*std::ranges::max_element(blocks) - *std::ranges::min_element(blocks) <= 1);
        }
    CHECK(takesTask({}, 5)); // not split
    CHECK(blockShards({100, 1, 1, 98}, 2) == std::vector<uint64_t>{0, 1, 1, 1});
    CHECK(blockShards({0, 0}, 3) == std::vector<uint64_t>{0, 0});
}

TEST_CASE("a run goes with the one that its budget is taken from")
{
    SweepConfig config;
    RunConfig none, depth, match;
    depth.reuse.policy = ReusePolicy::Depth;
    match.reuse.policy = ReusePolicy::Error;
    match.match_budget = true;
    config.matched = depth.reuse;
    RunConfig error = match;
    error.match_budget = false;
    config.runs = {none, error, match};
    const std::vector<RunConfig> runs = expandRuns(config);
    REQUIRE(runs.size() == 4); // none, error, depth, match
    const std::vector<uint64_t> shards = sweepShards(config, runs, std::vector<uint64_t>(8, 10), 8);
    CHECK(shards[2] == shards[3]);
    CHECK(shards[6] == shards[7]);
    CHECK(shards[0] != shards[1]);
    CHECK(shards[7] == 7);
}

TEST_CASE("a row keeps its bytes before its shard")
{
    const ShardFacts facts{2, 4, 7, 40, "0123456789abcdef", "fedcba9876543210"};
    CHECK(
        withShard(R"({"a":1.0})", facts) ==
        R"({"a":1.0,"shard":{"index":2,"count":4,"task":7,"tasks":40,"model":"0123456789abcdef","set":"fedcba9876543210"}})");
    const auto read = [](const char* text) {
        ShardFacts out;
        const OrderedJson json = OrderedJson::parse(text);
        describe(Record(json, "r").object("shard"), out);
        return out;
    };
    CHECK(read(withShard("{\"a\":1}", facts).c_str()) == facts);
    for (const char* bad :
         {R"({"shard":{}})", R"({"shard":{"index":5,"count":4,"task":7,"tasks":40,"model":"m","set":"s"}})",
          R"({"shard":{"index":1,"count":4,"task":40,"tasks":40,"model":"m","set":"s"}})",
          R"({"shard":{"index":1,"count":4,"task":-1,"tasks":40,"model":"m","set":"s"}})", R"({"shard":3})"})
        CHECK_THROWS_AS(read(bad), Error);
}
