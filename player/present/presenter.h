// SPDX-License-Identifier: Apache-2.0
// Brings finished pictures to a display through Vulkan: the module gsc_present, loaded when it is first used, so that the
// player starts where there is no Vulkan, no GLFW and no display. A picture lies in memory of this process, or in memory of
// the display's GPU that was shared with whoever draws; either way one copy brings it to the image that is shown, so bytes
// stay what they are. All calls from one thread, the process's first.
#pragma once

#include "player/present/overlay.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

using DeviceUuid = std::array<unsigned char, 16>;

constexpr uint32_t kWindowWidth = 1280, kWindowHeight = 720; // default size of the window

struct PresenterOptions {
    std::string title;
    uint32_t width = kWindowWidth, height = kWindowHeight; // size of the window, pixels
    bool windowed = true;                                  // false: images without a window, to be read back
    bool waits_for_display = true;                         // pictures change between two refreshes only
    std::optional<DeviceUuid> device; // the GPU that draws: the display's is the same, if it may be
};

// Codes of keys, buttons and modifiers are GLFW's.
struct InputEvent {
    enum class Kind : uint32_t { Key, Button, Move, Scroll };
    Kind kind = Kind::Key;
    int code = 0;         // code of a Key or Button
    bool down = false;    // for Key and Button; a repeated press of a held key is not an event
    int modifiers = 0;    // for Key and Button
    double x = 0, y = 0;  // Move: pixels of the picture, right and down; Scroll: notches
    bool overlay = false; // the overlay uses it, too, such as a click on the panel
};

// GLFW's layout of a gamepad: axes left x, left y, right x, right y, triggers (-1 to 1); bit b of buttons: button b.
struct GamepadState {
    bool present = false;
    std::array<float, 6> axes{};
    uint32_t buttons = 0;
};

struct WindowInput {
    std::vector<InputEvent> events; // since the call before
    GamepadState gamepad;
    uint32_t width = 0, height = 0; // size of the picture, pixels; 0 while the window is minimised
    float scale = 1;                // scale of text: 1 = 96 dots per inch
    bool exposed = false;           // the window's content is lost and must be shown again
    bool closed = false;            // the person wants it to
};

// A part of the GPU's memory that another program interface may open.
struct SharedBlock {
    uint32_t id = 0;
    size_t bytes = 0; // bytes of the allocation, at least those asked for
    int file = -1;    // opaque file descriptor, whose importer owns it
};

// Rows of width x 4 bytes, red first, or in the order that a headset wants (HeadsetFacts::pixels), without a gap.
struct ShownPicture {
    const std::byte* pixels = nullptr; // in memory of this process; null: in a shared block
    uint32_t block = 0;
    size_t offset = 0;  // in the block, bytes
    uint64_t ready = 0; // the display waits for this value of the shared semaphore before it reads; 0 = at once
    uint32_t width = 0, height = 0;
    uint32_t x = 0, y = 0; // place in the window, if its size is that of the canvas
    // FrameTarget's depths in memory of this process, rows without a gap, for a display that wants them; null: there are none
    const float* depth = nullptr;
};

struct FrameToShow {
    std::span<const ShownPicture> pictures;
    // Size of the canvas that pictures lie on, pixels; it is scaled to a window of another size. Parts without a
    // picture are black; without a window pictures cover all of it.
    uint32_t width = 0, height = 0;
    bool reads_back = false; // the displayed canvas, without the overlay
};

struct PresentTimes {
    double copy_ms = 0; // GPU time of the copies alone, of the last frame that is done
};

// Memory of the display's GPU that another program interface writes pictures to.
class SharedMemory {
public:
    virtual ~SharedMemory() = default;

    [[nodiscard]] virtual bool sharesMemory() const = 0; // true if it shares memory with the GPU that was asked for

    // Throws Error: OutOfMemory, Unsupported without sharesMemory().
    virtual SharedBlock makeShared(size_t bytes) = 0;
    virtual void freeShared(uint32_t id) = 0; // after the display has read it
    virtual int semaphoreFile() = 0; // file descriptor of a timeline semaphore that starts at 0; the importer owns it
    // Called when the importer has gone: nobody else signals the semaphore that the display waits for.
    virtual void importerGone() = 0;
};

class Presenter : public SharedMemory {
public:
    [[nodiscard]] virtual std::string deviceName() const = 0;
    [[nodiscard]] virtual bool readsBack() const = 0; // frames may ask for it

    // Input that has come; waits for some for at most so long. Throws Error(Device) where the display has gone.
    virtual WindowInput poll(double seconds) = 0;

    // Shows a frame; returns when the display can take the next one. False: nothing was shown, because the window is
    // minimised or being resized. `overlay`, if not null, is drawn over it, and takes what the person does there. Throws
    // Error: Device where display or GPU are lost, OutOfMemory.
    virtual bool show(const FrameToShow& frame, Overlay* overlay) = 0;

    // Last frame that was shown with reads_back: height rows of width x 4 bytes, red first. Waits for it.
    virtual std::vector<std::byte> readBack(uint32_t& width, uint32_t& height) = 0;

    virtual PresentTimes times() = 0;
    virtual void finish() = 0; // waits until no picture is being read
};

struct PresentFunctions {
    // Throws Error: Unsupported without Vulkan 1.2 or a display, naming the missing part; Device.
    std::unique_ptr<Presenter> (*open)(const PresenterOptions& options);
};

} // namespace gsc
