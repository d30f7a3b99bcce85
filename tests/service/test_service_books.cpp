// SPDX-License-Identifier: Apache-2.0
// The books of a renderer service under random work: every pose ends once, in order, whatever workers do.
#include "runtime/service/pose_ledger.h"

#include <doctest/doctest.h>

#include <map>
#include <random>
#include <stdexcept>

using namespace gsc;

namespace {

using namespace std::chrono_literals;

const std::exception_ptr kBroken = std::make_exception_ptr(std::runtime_error("broken"));

// Events of poses, and the ledger that they are told to.
struct Books {
    explicit Books(const LedgerRules& rules) : ledger(rules), keeps_all(rules.keeps_all) {}

    void add()
    {
        now += 1ms;
        last = ledger.add(now);
    }

    void beginNext(std::mt19937& random)
    {
        const uint64_t pose = ledger.next(now);
        if (pose == 0)
            return;
        std::vector<PosePart> parts;
        const uint32_t count = random() % 3 + 1;
        for (uint32_t i = 0; i < count; ++i)
            parts.push_back({1, {}, count == 1 ? kAnyWorker : int(i)});
        ledger.begin(pose, std::move(parts));
    }

    void settle()
    {
        for (const EndedPose& ended : ledger.takeEnded()) {
            CHECK(ends.emplace(ended.pose, ended.end).second); // never twice
            CHECK_FALSE(ledger.isOpen(ended.pose));
        }
    }

    void deliver()
    {
        if (const auto ended = ledger.deliver()) {
            CHECK(ended->pose > shown);
            if (keeps_all)
                CHECK(ended->pose == shown + 1);
            shown = ended->pose;
        }
        settle();
    }

    PoseLedger ledger;
    bool keeps_all;
    ServiceTime now{0};
    uint64_t last = 0, shown = 0;
    std::map<uint64_t, PoseEnd> ends;
};

void drawForAWhile(const LedgerRules& rules, uint32_t seed)
{
    std::mt19937 random(seed);
    Books books(rules);
    std::vector<std::pair<int, Job>> jobs;
    std::vector<Job> stale;
    constexpr int kWorkers = 3;
    for (int step = 0; step < 4000; ++step) {
        const auto pick = jobs.empty() ? jobs.begin() : jobs.begin() + std::ptrdiff_t(random() % jobs.size());
        switch (random() % 9) {
        case 0:
        case 1:
            books.add();
            break;
        case 2:
            books.beginNext(random);
            break;
        case 3:
        case 4: {
            const int worker = int(random() % kWorkers);
            if (const auto job = books.ledger.take(worker)) {
                CHECK(books.ledger.isDrawing(*job));
                jobs.emplace_back(worker, *job);
            }
            break;
        }
        case 5:
        case 6:
            if (pick != jobs.end()) {
                const bool was = books.ledger.isDrawing(pick->second);
                CHECK(books.ledger.drawn(pick->second) == was);
                stale.push_back(pick->second);
                jobs.erase(pick);
            }
            break;
        case 7:
            if (pick != jobs.end() && random() % 3 == 0) {
                (void)(random() % 4 == 0 ? books.ledger.fail(pick->second, kBroken)
                                         : books.ledger.giveBack(pick->second, kBroken));
                books.ledger.freeParts(pick->first);
                stale.push_back(pick->second);
                jobs.erase(pick);
            }
            break;
        default:
            books.deliver();
        }
        if (!stale.empty()) // a job that has ended or was given back has no effect any more
            CHECK_FALSE(books.ledger.drawn(stale[random() % stale.size()]));
        books.settle();
        const LedgerCounts& counts = books.ledger.counts();
        REQUIRE(counts.submitted == books.last);
        REQUIRE(counts.open() + books.ends.size() == books.last);
    }
    // all that is open comes to an end
    for (int rounds = 0; books.ledger.counts().open() > 0 && rounds < 100000; ++rounds) {
        books.beginNext(random);
        for (const auto& [worker, job] : jobs)
            (void)books.ledger.drawn(job);
        jobs.clear();
        for (int worker = 0; worker < kWorkers; ++worker)
            if (const auto job = books.ledger.take(worker))
                jobs.emplace_back(worker, *job);
        books.deliver();
    }
    CHECK(books.ends.size() == books.last);
    for (const auto& [pose, end] : books.ends)
        if (books.keeps_all)
            CHECK((end == PoseEnd::Shown || end == PoseEnd::Failed));
}

} // namespace

TEST_CASE("every pose ends once and in order, whatever workers do")
{
    for (uint32_t seed = 1; seed <= 20; ++seed) {
        CAPTURE(seed);
        drawForAWhile({true, ServiceTime{0}, 3}, seed);
        drawForAWhile({false, ServiceTime{0}, 3}, seed);
        drawForAWhile({false, 5ms, 2}, seed);
    }
}

TEST_CASE("the newest pose is drawn next, and older ones that wait expire")
{
    PoseLedger ledger({false, 10ms, 3});
    ledger.add(0ms);
    ledger.add(1ms);
    CHECK(ledger.next(2ms) == 2);
    CHECK(ledger.takeEnded().front().end == PoseEnd::Expired);
    ledger.begin(2, {{}});
    ledger.add(3ms);
    CHECK(ledger.next(20ms) == 0); // it has waited for more than 10 ms
    CHECK(ledger.counts().of(PoseEnd::Expired) == 2);
    const auto job = ledger.take(0);
    REQUIRE(job);
    CHECK(ledger.drawn(*job)); // a begun pose does not expire
    CHECK(ledger.deliver()->pose == 2);
}

TEST_CASE("a pose that is drawn after a newer one was delivered is late")
{
    PoseLedger ledger({});
    std::optional<Job> jobs[2];
    for (auto& job : jobs) {
        ledger.begin(ledger.next((ledger.add(0ms), 0ms)), {{}});
        job = ledger.take(0);
    }
    CHECK(ledger.drawn(*jobs[1]));
    CHECK(ledger.deliver()->pose == 2);
    CHECK(ledger.drawn(*jobs[0]));
    CHECK_FALSE(ledger.deliver());
    CHECK(ledger.counts().of(PoseEnd::Late) == 1);
    CHECK(ledger.counts().open() == 0);
}

TEST_CASE("a part that is given back is drawn by another worker, and its pose fails after so many attempts")
{
    PoseLedger ledger({true, ServiceTime{0}, 2});
    ledger.begin((ledger.add(0ms), ledger.next(0ms)), {{1, {}, 0}, {2, {}, 1}});
    const auto left = ledger.take(0), right = ledger.take(1);
    REQUIRE((left && right));
    CHECK_FALSE(ledger.take(1));
    CHECK(ledger.drawn(*left));
    CHECK(ledger.giveBack(*right, kBroken));
    CHECK_FALSE(ledger.drawn(*right));
    const auto again = ledger.take(0), other = ledger.take(0); // both parts anew: of the left as well
    REQUIRE((again && other));
    CHECK(ledger.giveBack(*other, kBroken));
    const auto failed = ledger.deliver();
    REQUIRE(failed);
    CHECK(failed->end == PoseEnd::Failed);
    CHECK(failed->error == kBroken);
}

TEST_CASE("without a worker all that waits fails, and what is drawn is delivered before it")
{
    PoseLedger ledger({true, ServiceTime{0}, 2});
    for (int i = 0; i < 3; ++i)
        ledger.add(0ms);
    ledger.begin(ledger.next(0ms), {{}});
    CHECK(ledger.drawn(*ledger.take(0)));
    ledger.failWaiting(kBroken);
    CHECK(ledger.deliver()->end == PoseEnd::Shown);
    CHECK(ledger.deliver()->end == PoseEnd::Failed);
    CHECK(ledger.deliver()->end == PoseEnd::Failed);
    CHECK_FALSE(ledger.deliver());
}
