// Provides variables that free their contents where their scope ends. A test that fails leaks them.
#pragma once

#include <stdlib.h>

static inline void pointer_free(void *pointer)
{
    free(*(void **)pointer);
}

#define OWNED              __attribute__((cleanup(pointer_free))) // a pointer
#define OwnedBenchTimes    __attribute__((cleanup(bench_times_free))) BenchTimes
#define OwnedCertifySample __attribute__((cleanup(certify_sample_close))) CertifySample
#define OwnedCompiledScene __attribute__((cleanup(compiled_scene_free))) CompiledScene
#define OwnedFilm          __attribute__((cleanup(film_free))) Film
#define OwnedImage         __attribute__((cleanup(image_free))) Image
#define OwnedMessageList   __attribute__((cleanup(message_list_free))) MessageList
#define OwnedScene         __attribute__((cleanup(scene_free))) Scene
#define OwnedText          __attribute__((cleanup(text_free))) Text
