// SPDX-License-Identifier: Apache-2.0
#include "player/output/video_file.h"

#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include "format/machine/machine.h"
#include "format/machine/threads.h"
#include "runtime/module/find_program.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace gsc {

namespace {

constexpr size_t kVideoThreads = 32; // most threads that ffmpeg may use

// Repeats the last row or column if the height or width of the video would be odd.
Image evened(const Image& image, uint32_t width, uint32_t height)
{
    Image even{width, height, std::vector<float>(size_t(width) * height * 3)};
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            const size_t from = size_t(std::min(y, image.height - 1)) * image.width + std::min(x, image.width - 1);
            std::copy_n(&image.pixels[from * 3], 3, &even.pixels[(size_t(y) * width + x) * 3]);
        }
    return even;
}

std::vector<std::string> videoArguments(uint32_t width, uint32_t height, double fps, const std::string& path)
{
    return {"ffmpeg",
            "-nostdin",
            "-v",
            "error",
            "-f",
            "rawvideo",
            "-pix_fmt",
            "rgb24",
            "-s",
            std::to_string(width) + "x" + std::to_string(height),
            "-r",
            rateText(fps, '/'),
            "-i",
            "pipe:0",
            "-vf",
            "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int",
            "-c:v",
            "libx264",
            "-crf",
            "10",
            "-pix_fmt",
            "yuv420p",
            "-colorspace",
            "bt709",
            "-color_primaries",
            "bt709",
            "-color_trc",
            "iec61966-2-1",
            "-color_range",
            "tv",
            "-movflags",
            "+faststart",
            "-f",
            "mp4",
            "-y",
            path};
}

} // namespace

struct VideoFile::Encoder {
    OutputFile file;
    std::FILE* said; // text that ffmpeg writes to standard error
    pid_t process = 0;
    int pipe = -1;
    std::unique_ptr<PictureStream> stream;

    Encoder(const std::string& path, bool overwrite) : file(path, OutputKind::Binary, overwrite), said(std::tmpfile())
    {
        if (said == nullptr)
            throw Error(ErrorCode::Io, "--video", formatString("no temporary file (%s)", std::strerror(errno)),
                        "a folder for one", "set TMPDIR to one that may be written");
    }
    Encoder(const Encoder&) = delete;
    Encoder& operator=(const Encoder&) = delete;
    ~Encoder()
    {
        closePipe();
        if (process != 0) {
            ::kill(process, SIGKILL);
            (void)wait();
        }
        std::fclose(said);
    }

    void closePipe()
    {
        if (pipe >= 0)
            ::close(pipe);
        pipe = -1;
    }

    // Waits until ffmpeg ends. Returns its exit code, or 128 plus the number of the signal that ended it.
    int wait()
    {
        int status = 0;
        while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
        }
        process = 0;
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }

    void start(const std::vector<std::string>& arguments)
    {
        const std::string program = programInPath("ffmpeg");
        int ends[2];
        if (::pipe2(ends, O_CLOEXEC) != 0)
            throw Error(ErrorCode::Io, "--video", formatString("no pipe to ffmpeg (%s)", std::strerror(errno)), "one",
                        "close other programs");
        pipe = ends[1];
        std::vector<char*> words;
        for (const std::string& argument : arguments)
            words.push_back(const_cast<char*>(argument.c_str()));
        words.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        ::posix_spawn_file_actions_init(&actions);
        ::posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
        ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
        ::posix_spawn_file_actions_adddup2(&actions, ::fileno(said), STDERR_FILENO);
        // a process group of its own: Ctrl-C must reach this program alone, which then ends ffmpeg
        posix_spawnattr_t attributes;
        ::posix_spawnattr_init(&attributes);
        ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
        sigset_t ours; // signals that this program ignores and that shall have their default effect on ffmpeg
        sigemptyset(&ours);
        sigaddset(&ours, SIGPIPE);
        sigaddset(&ours, SIGXFSZ);
        ::posix_spawnattr_setsigdefault(&attributes, &ours);
        const int code = ::posix_spawn(&process, program.c_str(), &actions, &attributes, words.data(), environ);
        ::posix_spawnattr_destroy(&attributes);
        ::posix_spawn_file_actions_destroy(&actions);
        ::close(ends[0]);
        if (code != 0)
            process = 0;
        else
            restoreLimits(process);
        if (code == EAGAIN)
            throw tooFewThreads(program + ", which writes the video");
        if (code != 0) {
            throw Error(ErrorCode::Io, program, formatString("cannot be started (%s)", std::strerror(code)),
                        "the program ffmpeg", "check it");
        }
    }

    void write(std::span<const std::byte> bytes)
    {
        while (!bytes.empty()) {
            const ssize_t done = ::write(pipe, bytes.data(), bytes.size());
            if (done < 0 && errno == EINTR)
                continue;
            if (done <= 0)
                finish(true);
            bytes = bytes.subspan(size_t(done));
        }
    }

    // Waits for ffmpeg; throws Error(Io) if it failed. `early`: it stopped reading before the last picture, which is a
    // failure too.
    void finish(bool early)
    {
        closePipe();
        const int code = wait();
        if (code == 0 && !early)
            return;
        std::rewind(said);
        char line[300] = "";
        const size_t length = std::fread(line, 1, sizeof(line) - 1, said);
        std::string text(line, length);
        text = text.substr(0, text.find('\n'));
        // thread limit too low: ffmpeg does not report every thread that it could not start
        if (threadsAreShort(0) && text.find("No space left") == std::string::npos)
            throw tooFewThreads("ffmpeg, which writes the video" + (text.empty() ? "" : " and says \"" + text + "\""),
                                kVideoThreads);
        throw Error(
            ErrorCode::Io, "--video",
            formatString("ffmpeg ended with exit code %d (%s)", code, text.empty() ? "it said nothing" : text.c_str()),
            "it to write the video", "see that it has libx264, and room for the file");
    }
};

VideoFile::VideoFile(const std::string& path, uint32_t width, uint32_t height, uint32_t eye_count, double fps,
                     bool overwrite)
{
    checkVideoProgram();
    // the width of two eyes side by side is always even
    m_width = width + (width * eye_count) % 2;
    m_height = height + height % 2;
    m_padded = m_width != width || m_height != height;
    m_encoder = std::make_unique<Encoder>(path, overwrite);
    Encoder& encoder = *m_encoder;
    encoder.start(videoArguments(m_width * eye_count, m_height, fps, encoder.file.temporaryPath()));
    encoder.stream =
        std::make_unique<PictureStream>(StreamFormat::Rgb24, m_width, m_height, eye_count, fps,
                                        [&encoder](std::span<const std::byte> bytes) { encoder.write(bytes); });
}

VideoFile::~VideoFile() = default;

void VideoFile::add(std::span<const Image> eyes)
{
    if (!m_padded)
        return m_encoder->stream->add(eyes);
    std::vector<Image> even;
    for (const Image& eye : eyes)
        even.push_back(evened(eye, m_width, m_height));
    m_encoder->stream->add(even);
}

void VideoFile::commit()
{
    m_encoder->finish(false);
    m_encoder->file.commit();
}

void checkVideoProgram(const std::string& option)
{
    if (programInPath("ffmpeg").empty())
        throw Error(ErrorCode::Unsupported, option, "there is no ffmpeg in PATH", "the program that encodes",
                    "install it (ffmpeg), or pipe --out - into another");
}

} // namespace gsc
