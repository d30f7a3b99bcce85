// SPDX-License-Identifier: Apache-2.0
#include "player/model/converted_model.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>
#include "format/file/trained_model.h"
#include "format/machine/machine.h"
#include "kernels/threads/stopwatch.h"
#include "runtime/cli/printed_command.h"
#include "runtime/module/find_program.h"
#include <gsc/gsc_layout.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace gsc {

namespace {

using Json = nlohmann::json;

constexpr double kShort = 1000; // milliseconds after which progress is worth a line

// The files stay until the program ends: their scenes and checksums are read again and again.
std::map<std::string, std::unique_ptr<TemporaryGsc>>& convertedFiles()
{
    static std::map<std::string, std::unique_ptr<TemporaryGsc>> files;
    return files;
}

// A running program whose output is read through pipes. The destructor ends it.
class Child {
public:
    Child(const std::string& program, const std::vector<std::string>& arguments)
    {
        std::array<int, 2> out{}, err{};
        if (::pipe2(out.data(), O_CLOEXEC) != 0)
            fail(program, errno);
        if (::pipe2(err.data(), O_CLOEXEC) != 0) {
            ::close(out[0]);
            ::close(out[1]);
            fail(program, errno);
        }
        m_pipes = {out[0], err[0]};
        std::vector<char*> words = {const_cast<char*>(program.c_str())};
        for (const std::string& argument : arguments)
            words.push_back(const_cast<char*>(argument.c_str()));
        words.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        ::posix_spawn_file_actions_init(&actions);
        ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        ::posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
        ::posix_spawn_file_actions_adddup2(&actions, err[1], STDERR_FILENO);
        // a process group of its own: Ctrl-C must reach this program alone, which then ends the other
        posix_spawnattr_t attributes;
        ::posix_spawnattr_init(&attributes);
        ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
        const int code = ::posix_spawn(&m_process, program.c_str(), &actions, &attributes, words.data(), environ);
        ::posix_spawnattr_destroy(&attributes);
        ::posix_spawn_file_actions_destroy(&actions);
        ::close(out[1]);
        ::close(err[1]);
        if (code != 0) {
            m_process = 0;
            closePipes();
            fail(program, code);
        }
        restoreLimits(m_process);
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;
    ~Child()
    {
        closePipes();
        if (m_process != 0) {
            ::kill(m_process, SIGKILL);
            (void)wait();
        }
    }

    // Reads both outputs until they end; `take` gets each line of standard error. Returns standard output. Throws
    // Error(Interrupted).
    template <typename Take>
    std::string read(const Take& take)
    {
        std::array<std::string, 2> texts;
        std::array<pollfd, 2> waited = {pollfd{m_pipes[0], POLLIN, 0}, pollfd{m_pipes[1], POLLIN, 0}};
        while (waited[0].fd >= 0 || waited[1].fd >= 0) {
            throwIfInterrupted();
            constexpr int kMilliseconds = 100;
            (void)::poll(waited.data(), waited.size(), kMilliseconds);
            for (size_t i = 0; i < waited.size(); ++i) {
                if (waited[i].fd < 0 || waited[i].revents == 0)
                    continue;
                char buffer[4096];
                const ssize_t count = ::read(waited[i].fd, buffer, sizeof(buffer));
                if (count > 0)
                    texts[i].append(buffer, size_t(count));
                else if (count == 0 || errno != EINTR)
                    waited[i].fd = -1;
            }
            for (size_t end; (end = texts[1].find('\n')) != std::string::npos; texts[1].erase(0, end + 1))
                take(texts[1].substr(0, end));
        }
        return texts[0];
    }

    // Waits for the end. Returns the exit code, or 128 plus the number of the signal that ended it.
    int wait()
    {
        int status = 0;
        while (::waitpid(m_process, &status, 0) < 0 && errno == EINTR) {
        }
        m_process = 0;
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }

private:
    [[noreturn]] static void fail(const std::string& program, int code)
    {
        throw Error(ErrorCode::Io, program, formatString("cannot be started (%s)", std::strerror(code)),
                    "the program that converts trained models", "check it, or convert the model first");
    }

    void closePipes()
    {
        for (int& pipe : m_pipes)
            if (pipe >= 0)
                ::close(std::exchange(pipe, -1));
    }

    pid_t m_process = 0;
    std::array<int, 2> m_pipes = {-1, -1};
};

// The error that `gsc convert --format json` printed. Its remedies name options, which are that command's.
Error convertError(const std::string& model, const std::string& out, const Error& otherwise)
{
    try {
        const Json json = Json::parse(out);
        if (json.at("schema") != "gsc.error/1" || json.at("exit_code") == 0)
            return otherwise;
        return {ErrorCode(json.at("exit_code").get<int>()), json.value("subject", model), json.at("found"),
                json.at("expected"), convertAdvice(json.at("remedy"))};
    } catch (const Json::exception&) {
        return otherwise;
    }
}

// Passes a line of `gsc convert --progress json` on. Returns false if it is no event.
bool passOn(const std::string& line, bool tells_progress, Reporter& log)
{
    try {
        const Json event = Json::parse(line);
        const std::string kind = event.at("event");
        if (kind == "warning")
            log.warning(convertAdvice(event.at("message")));
        else if (kind == "progress" && tells_progress)
            log.progress(("convert, " + event.at("stage").get<std::string>()).c_str(), event.at("done"),
                         event.at("total"));
        return true;
    } catch (const Json::exception&) {
        return false;
    }
}

bool isGsc(const std::string& path)
{
    std::array<unsigned char, sizeof(kMagic)> head{};
    std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(head.data()), head.size());
    return std::ranges::equal(head, kMagic);
}

} // namespace

void convertModel(const std::string& model, Reporter& log)
{
    if (convertedFiles().contains(model) || !isTrainedModel(model))
        return;
    const std::string program = ownProgram("gsc");
    if (program.empty())
        throw Error(ErrorCode::Unsupported, model,
                    "is a trained model, and the program gsc, which converts those, is not beside gsc-play or in PATH",
                    "a .gsc file", "convert it where gsc is: gsc convert MODEL -o FILE.gsc");
    const auto start = std::chrono::steady_clock::now();
    auto file = std::make_unique<TemporaryGsc>(model);
    Child child(program, {"convert", "--format", "json", "--progress", "json", "-o", file->path(), "--input", model});
    std::string said; // last line that is no event
    const std::string out = child.read([&](const std::string& line) {
        if (!passOn(line, millisecondsSince(start) > kShort, log))
            said = line;
    });
    const int code = child.wait();
    const bool is_made = code == 0 && isGsc(file->path());
    log.endProgress(!is_made);
    if (!is_made)
        throw convertError(
            model, out,
            {ErrorCode::Unsupported, model,
             formatString("%s convert ended with exit code %d%s (%s)", program.c_str(), code,
                          code == 0 ? " and has written no .gsc" : "", said.empty() ? "it said nothing" : said.c_str()),
             "it to convert the model", "convert it first, with the gsc that belongs to gsc-play"});
    log.tell(formatString("%s: converted in %.1f s for this run; gsc convert %s keeps the file", model.c_str(),
                          millisecondsSince(start) / 1000, shellWord(model).c_str()));
    convertedFiles().emplace(model, std::move(file));
}

std::string gscPath(const std::string& model)
{
    const auto found = convertedFiles().find(model);
    return found == convertedFiles().end() ? model : found->second->path();
}

} // namespace gsc
